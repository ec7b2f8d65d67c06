// The rod in space at one trial shape: kinematics and objective, with their derivatives.
#pragma once

#include <cmath>
#include <vector>

#include "math/riccati.hpp"
#include "model/arc.hpp"
#include "model/law_slopes.hpp"
#include "model/robot.hpp"
#include "model/rod_cables.hpp"
#include "model/spatial_chain.hpp"

namespace ccr {

// Segments are arcs, their controls rotation vectors: bending towards -y and +x, and twist.
class SpatialRod {
 public:
  static constexpr int kSpace = 3, kTurn = 3, kControl = 3, kCables = kMaxCables;
  static constexpr int kState = 6;  // position, and small rotation about the axes of the base frame
  static constexpr bool kRod = true;
  static constexpr int kInputs = 1;     // of the segment law that change: the length
  static constexpr int kShears = 3;     // controls that damping is measured by
  static constexpr int kDiskSides = 1;  // the disks of a segment can meet on whatever side it bends to
  static constexpr int kTip = 0;        // slopes of the free tip, which this model does not have

  using Command = ccr::Command<kCables>;
  using Control = Vec<kControl>;
  using State = Vec<kState>;
  using Frame = Mat<3, 3>;  // its columns are the axes of the disk
  using System = Riccati<kState, kControl, SpatialTransition>;

  explicit SpatialRod(const Robot& robot);
  void set_robot(const Robot& robot);  // with as many segments and cables

  static Position<3> lever(const Frame& frame, const Vec<2>& line) { return disk_lever(frame, line); }

  // Evaluates the shape under a command; false where a control is out of range of the segment law.
  bool evaluate(const Command& command, const std::vector<Control>& controls);

  // Computes the adjoints and the gradient of the Lagrangian J - Σ λ c in the controls; `node_forces` is Σ λ ∇c at
  // each node.
  void propagate_adjoints(const std::vector<State>& node_forces);
  // Hessian of the Lagrangian without that of the gaps; follows propagate_adjoints.
  void lagrangian_hessian(System& system) const;
  Vec<kCables> displacement_slopes() const { return {}; }  // the tensions are the multipliers of the slacks

  bool has_free_form() const { return false; }
  Control free_control(const Command&) const { return {}; }
  double free_slack_multiplier() const { return 0; }
  Vec<1> free_slopes(const Command&) const { return {}; }

  const RodCables<kControl>& cables() const { return cables_; }
  // Adds the slacks with their multipliers to the Lagrangian; follows propagate_adjoints.
  void add_slacks(const Vec<kCables>& multipliers) { cables_.set_multipliers(multipliers, gradient); }

  // Where the disks of a segment are closest: its bending and their gap there.
  double bend(int segment) const { return std::hypot(controls_.at(0, segment), controls_.at(1, segment)); }
  int disk_side(int) const { return 0; }
  DiskGap disk_gap(int segment, int side) const;
  // Slope of that gap in the control and as moments on the lower and upper disk, and its curvature in the control.
  Control disk_slope(int segment, const DiskGap& gap) const;
  Vec<3> disk_moment(int segment, const DiskGap& gap) const;
  Mat<3, 3> disk_curvature(int segment, const DiskGap& gap) const;

  // Slope of the gap in the length of the robot, and that one's in the control.
  LengthSlope<Control> disk_length_slope(int segment, int side) const;

  // Slopes in the first inputs of the segment law; follows lagrangian_hessian.
  void input_slopes(const Command& command, const std::vector<Control>& controls, int inputs,
                    InputSlopes<SpatialRod>& slopes) const;

  double widest_shear() const { return HUGE_VAL; }
  double free_turn() const { return 0; }
  double segment_length() const { return length_; }

  std::vector<State> states;
  std::vector<Frame> frames;
  std::vector<Control> gradient;
  double objective = 0;
  double max_objective_slope = 0;  // of the objective alone, in a control
  double widest = 0;               // largest rotation of a segment

 private:
  void add_strain(const std::vector<Control>& controls);
  bool keeps_edges(const std::vector<Control>& controls) const;
  void take_up_cables(bool alike);

  Robot robot_;
  double length_ = 0;  // of a segment [mm]
  Rows controls_, shared_, adjoints_;
  mutable Rows hessians_;
  std::vector<Arc> arcs_;
  std::vector<Control> strain_slopes_;  // slope of the objective in the controls
  std::vector<Vec<3>> chords_;          // of the segments, in the base frame
  std::vector<Wrench> wrenches_;        // adjoints of the upper state of each segment, in its lower disk's frame
  RodCables<kControl> cables_;
  std::vector<double> distances_;  // of the holes of a cable in both disks, by cable and segment [mm]
  std::vector<ArcCable> arc_cables_;
  mutable std::vector<ArcPull> pulls_;  // of the taut cables
};

}  // namespace ccr
