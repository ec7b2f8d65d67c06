// What is the same for the models of a robot.
#pragma once

#include <vector>

#include "math/rotations.hpp"

namespace ccr {

// In the plane the model of the paper or the discrete rod, in space that of the paper (eq. 13).
enum class ModelKind { kPaper, kRod, kSpatial };

struct Robot {
  ModelKind model;
  int segments;
  double offset;                       // cables from backbone [mm]
  double angle;                        // from the first cable to the second [rad]
  double rigidity;                     // EI [N mm^2]
  double max_tension;                  // [N]
  double max_length;                   // of the backbone, what places are measured by [mm]
  double disk_radius, disk_thickness;  // of the disks that meet where a segment bends far [mm]
  std::vector<Vec<2>> lines;           // place on the disk of each line of points that can touch [mm]
  std::vector<double> edges;           // the longest edge between neighbouring points of each line [mm]
  int between;                         // points of a line between two nodes

  int positions() const { return segments * (between + 1) + 1; }  // of a line
  int points() const { return static_cast<int>(lines.size()) * positions(); }
  double energy_scale(double length) const { return rigidity * segments / (2 * length); }  // EI / 2 l0 [N mm]
};

// Of the disks of a segment on one side, in the angle between them [mm, mm per rad].
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
