// The robot in space (eq. 13) at one trial shape: kinematics and objective, with their derivatives.
#pragma once

#include <vector>

#include "math/riccati.hpp"
#include "model/law_slopes.hpp"
#include "model/robot.hpp"
#include "model/segment.hpp"
#include "model/spatial_chain.hpp"

namespace ccr {

// Two pairs of cables: a negative displacement pulls the cable on the opposite side. The controls of a segment are two
// shears and the twist; the cables determine its bending.
class SpatialPaper {
 public:
  static constexpr int kSpace = 3, kTurn = 3, kControl = 3, kCables = 2;
  static constexpr int kState = 6;  // position, and small rotation about the axes of the base frame
  static constexpr bool kRod = false;
  static constexpr int kInputs = 3;  // of the segment law that change: both cables, the length
  static constexpr int kShears = 2;  // leading controls that shear a segment
  static constexpr int kTip =
      10;  // slopes of the free tip in each displacement: position, and rotation towards both cables

  static constexpr int kDiskSides = 0;  // the disks of a segment shear before they meet

  using Command = ccr::Command<kCables>;
  using Control = Vec<kControl>;
  using State = Vec<kState>;
  using Frame = Mat<3, 3>;  // its columns are the axes of the disk
  using System = Riccati<kState, kControl, SpatialTransition>;

  explicit SpatialPaper(const Robot& robot);
  void set_robot(const Robot& robot) { robot_ = robot; }  // with as many segments

  static Position<3> lever(const Frame& frame, const Vec<2>& line) { return disk_lever(frame, line); }

  // Evaluates the shape under a command; false where the cables cannot have their lengths.
  bool evaluate(const Command& command, const std::vector<Control>& controls);

  // Computes the adjoints and the gradient of the Lagrangian J - Σ λ c in the controls; `node_forces` is Σ λ ∇c at
  // each node.
  void propagate_adjoints(const std::vector<State>& node_forces);
  // Hessian of the Lagrangian without that of the gaps; follows propagate_adjoints.
  void lagrangian_hessian(System& system) const;
  Vec<2> displacement_slopes() const;  // of the Lagrangian in the size of each displacement; follows propagate_adjoints

  bool has_free_form() const { return true; }
  Vec<kTip> free_slopes(const Command& command) const;

  // Slopes in the first inputs of the segment law; follows lagrangian_hessian.
  void input_slopes(const Command& command, const std::vector<Control>& controls, int inputs,
                    InputSlopes<SpatialPaper>& slopes) const;

  // Sine of the shear angle at which a segment folds over.
  double widest_shear() const { return 1; }
  double free_turn() const;  // approximate angle of a free segment
  double segment_length() const { return inputs_.length; }

  std::vector<State> states;
  std::vector<Frame> frames;
  std::vector<Control> gradient;
  double objective = 0;
  double max_objective_slope = 0;  // of the objective alone, in a control

 private:
  // Outputs of the segment law, in the frame of the lower disk.
  struct Bend {
    Vec<3> chord;
    Mat<3, 3> rotation;
    double objective;
    Vec<3> objective_slope;
    Mat<3, 3> chord_slope, turn_slope;
    Vec<2> objective_displacement_slope;
    Mat<3, 2> chord_displacement_slope, turn_displacement_slope;
  };

  static_assert(sizeof(Bend) == SpatialLaw::kBend * sizeof(double));

  void set_inputs(const Command& command);

  Robot robot_;
  SegmentInputs inputs_{};
  Rows controls_, bendings_, laws_, adjoints_;
  mutable Rows hessians_;
  std::vector<Bend> bends_;
  std::vector<Vec<3>> chords_;    // of the segments, in the base frame
  std::vector<Wrench> wrenches_;  // adjoints of the upper state of each segment, in its lower disk's frame
};

}  // namespace ccr
