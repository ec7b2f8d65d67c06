// What all models share: the robot, its command, and the gap of its disks.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "math/rotations.hpp"

namespace ccr {

// The model of the paper (eq. 5 in the plane, eq. 13 in space) or the rod.
enum class ModelKind { kPlanarPaper, kPlanarRod, kSpatialPaper, kSpatialRod };

inline constexpr int kMaxCables = 12;  // of a rod

// A cable of a rod, from the base to the disk of a node.
struct Cable {
  Vec<2> hole;  // where it crosses the disks [mm]
  int end;      // node of its last disk
};

// A dead load on the disk of a node: a force at a point of the disk, and in the plane a moment.
struct Load {
  int node;
  Vec<2> at;      // [mm]
  Vec<3> force;   // in the base frame [N]
  double moment;  // counter-clockwise [N mm]
};

// What a rod has beyond a robot of the paper's model. Numbers of segments are one for each control.
struct Rod {
  std::vector<Cable> cables;
  std::vector<double> stiffness;  // EI and GJ of each segment, over the robot's rigidity
  std::vector<double> rest;       // controls of each segment at rest: its precurvature [rad]
  Vec<3> weight{};                // of a unit of length, in the base frame [N/mm]
  std::vector<Load> loads;
  double least_pull = 0;            // of a cable [mm]
  double bounded_twist = HUGE_VAL;  // of a segment in space, up to which no edge is too long [rad]
};

struct Robot {
  ModelKind model;
  int segments;
  double offset;                       // of the cables from the backbone [mm]
  double angle;                        // from the first cable to the second, in the paper's model of space [rad]
  double rigidity;                     // EI [N mm^2]
  double max_tension;                  // [N]
  double max_length;                   // of the backbone; the unit of lengths in tolerances [mm]
  double disk_radius, disk_thickness;  // rod: of the disks, which meet where a segment bends far [mm]
  std::vector<Vec<2>> lines;           // where each line of points that can touch crosses the disks [mm]
  std::vector<double> edges;           // longest distance of neighbouring points of each line [mm]
  int between;                         // number of points of a line between two nodes
  Rod rod = {};

  int positions() const { return segments * (between + 1) + 1; }  // of a line
  int points() const { return static_cast<int>(lines.size()) * positions(); }
  bool loaded() const { return rod.weight.v != Vec<3>{}.v || !rod.loads.empty(); }
  // Whether all segments of the robot that nothing touches bend alike.
  bool bends_evenly() const {
    const auto even = [this](const std::vector<double>& values) {
      const std::size_t each = values.size() / segments;
      return std::equal(values.begin() + each, values.end(), values.begin());
    };
    const auto whole = [this](const Cable& cable) { return cable.end == segments; };
    return rod.cables.empty() || (std::all_of(rod.cables.begin(), rod.cables.end(), whole) && even(rod.stiffness) &&
                                  even(rod.rest) && !loaded());
  }
  double energy_scale(double length) const { return rigidity * segments / (2 * length); }  // EI / 2 l0 [N mm]
};

// Gap of the two disks of a segment on one side, and its derivatives in the angle between them [mm, rad].
struct DiskGap {
  double value, slope, curvature;
};

template <int C>
struct Command {
  Vec<C> cables;     // displacements [mm]
  double length;     // of the backbone [mm]
  double loads = 1;  // part of a rod's loads that act
  double scene = 1;  // part of their way that moving obstacles have gone

  friend bool operator==(const Command& a, const Command& b) {
    return a.cables.v == b.cables.v && a.length == b.length && a.loads == b.loads && a.scene == b.scene;
  }
};

}  // namespace ccr
