// What all models share: the robot, its command, and the gap of its disks.
#pragma once

#include <vector>

#include "math/rotations.hpp"

namespace ccr {

// The model of a segment: in the plane that of the paper or the discrete rod, in space that of the paper (eq. 13).
enum class ModelKind { kPaper, kRod, kSpatial };

struct Robot {
  ModelKind model;
  int segments;
  double offset;                       // of the cables from the backbone [mm]
  double angle;                        // from the first cable to the second [rad]
  double rigidity;                     // EI [N mm^2]
  double max_tension;                  // [N]
  double max_length;                   // of the backbone; the unit of lengths in tolerances [mm]
  double disk_radius, disk_thickness;  // rod: of the disks, which meet where a segment bends far [mm]
  std::vector<Vec<2>> lines;           // where each line of points that can touch crosses the disks [mm]
  std::vector<double> edges;           // longest distance of neighbouring points of each line [mm]
  int between;                         // number of points of a line between two nodes

  int positions() const { return segments * (between + 1) + 1; }  // of a line
  int points() const { return static_cast<int>(lines.size()) * positions(); }
  double energy_scale(double length) const { return rigidity * segments / (2 * length); }  // EI / 2 l0 [N mm]
};

// Gap of the two disks of a segment on one side, and its derivatives in the angle between them [mm, rad].
struct DiskGap {
  double value, slope, curvature;
};

template <int C>
struct Command {
  Vec<C> cables;  // displacements [mm]
  double length;  // of the backbone [mm]

  friend bool operator==(const Command& a, const Command& b) {
    return a.cables.v == b.cables.v && a.length == b.length;
  }
};

}  // namespace ccr
