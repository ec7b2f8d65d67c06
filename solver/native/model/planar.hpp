// The robot in the plane at one trial shape: kinematics and objective, with their derivatives.
#pragma once

#include <vector>

#include "math/riccati.hpp"
#include "model/law_slopes.hpp"
#include "model/robot.hpp"
#include "model/rod_cables.hpp"
#include "model/segment.hpp"

namespace ccr {

// Derivative of the upper state of a segment in its lower one: the identity, and the motion of the upper node per
// rotation of the lower disk.
struct PlanarTransition {
  double x, y;
};

template <int N, class T>
Vec<N, T> times(const PlanarTransition& a, Vec<N, T> s) {
  s[0] += a.x * s[2];
  s[1] += a.y * s[2];
  return s;
}

template <int R, int N>
void multiply(Mat<R, N>& m, const PlanarTransition& a) {
  for (int r = 0; r < R; ++r) m(r, 2) += m(r, 0) * a.x + m(r, 1) * a.y;
}

template <int N, int C, class T>
Mat<N, C, T> transpose_times(const PlanarTransition& a, Mat<N, C, T> m) {
  for (int c = 0; c < C; ++c) m(2, c) += a.x * m(0, c) + a.y * m(1, c);
  return m;
}

// `Law` is the model of a segment: that of the paper, with one cable, or that of the rod.
template <class Law>
class Planar {
 public:
  static constexpr int kSpace = 2, kTurn = 1, kControl = 1;
  static constexpr int kShears = 1;  // leading controls that shear a segment
  static constexpr int kState = 3;   // x, y, disk angle
  static constexpr bool kRod = Law::kRod;
  static constexpr int kCables = kRod ? kMaxCables : 1;
  static constexpr int kInputs = kRod ? 1 : 2;  // of the segment law that change: the paper's cable, the length
  static constexpr int kDiskSides = 2;  // on which the disks of a segment can meet: that of +x at rest, and the other
  static constexpr int kTip = 3;        // slopes of the free tip: x, y, angle

  using Command = ccr::Command<kCables>;

  using Control = Vec<kControl>;
  using State = Vec<kState>;
  using Frame = Vec<2>;  // direction from the backbone to the cable
  using System = Riccati<kState, kControl, PlanarTransition>;

  explicit Planar(const Robot& robot);
  void set_robot(const Robot& robot);  // with as many segments and cables

  static Position<2> lever(const Frame& frame, const Vec<2>& line) {
    return {{line[0] * frame[0], line[0] * frame[1]}};
  }

  // Evaluates the shape under a command; false where a control is out of range of the segment law.
  bool evaluate(const Command& command, const std::vector<Control>& controls);

  // Computes the adjoints and the gradient of the Lagrangian J - Σ λ c in the controls; `node_forces` is Σ λ ∇c at
  // each node.
  void propagate_adjoints(const std::vector<State>& node_forces);
  // Hessian of the Lagrangian without that of the gaps; follows propagate_adjoints.
  void lagrangian_hessian(System& system) const;
  Vec<kCables> displacement_slopes() const;  // of the Lagrangian in the displacement; follows propagate_adjoints

  // Whether the shape of the robot that nothing touches is known in closed form: of the rod where one cable bends it.
  bool has_free_form() const { return has_free_form_; }
  // Control of every segment of such a robot, and for the rod the multiplier of the slack.
  Control free_control(const Command& command);
  double free_slack_multiplier() const requires(kRod);
  Vec<kTip> free_slopes(const Command& command);  // zero without the closed form

  const RodCables<kControl>& cables() const requires(kRod) { return cables_; }
  // Adds the slacks with their multipliers to the Lagrangian; follows propagate_adjoints.
  void add_slacks(const Vec<kCables>& multipliers) requires(kRod) { cables_.set_multipliers(multipliers, gradient); }

  // Where the disks of a segment are closest: on which side, and their gap.
  double bend(int segment) const requires(kRod) { return bends_[segment].angle; }
  int disk_side(int segment) const requires(kRod) { return bends_[segment].angle < 0; }
  DiskGap disk_gap(int segment, int side) const requires(kRod);
  // Slope of that gap in the control and as moments on the lower and upper disk, and its curvature in the control.
  Control disk_slope(int, const DiskGap& gap) const requires(kRod) { return {{gap.slope}}; }
  Vec<1> disk_moment(int segment, const DiskGap& gap) const requires(kRod) { return {{-gap.slope}}; }
  Mat<1, 1> disk_curvature(int segment, const DiskGap& gap) const requires(kRod) { return {{gap.curvature}}; }
  // Slope of the gap in the length of the robot, and that one's in the control.
  LengthSlope<Control> disk_length_slope(int segment, int side) const requires(kRod);

  // Slopes in the first inputs of the segment law; follows lagrangian_hessian.
  void input_slopes(const Command& command, const std::vector<Control>& controls, int inputs,
                    InputSlopes<Planar>& slopes) const;

  // Sine of the shear angle at which a segment folds over.
  double widest_shear() const { return kRod ? HUGE_VAL : 1 - displacement_ / length_; }
  double free_turn() const { return displacement_ / robot_.offset; }  // approximate angle of a free segment
  double segment_length() const { return length_; }

  std::vector<State> states;
  std::vector<Frame> frames;
  std::vector<Control> gradient;
  double objective = 0;
  double max_objective_slope = 0;  // of the objective alone, in a control
  double widest = 0;               // largest angle between consecutive disks

 private:
  void slope_arcs(InputSlopes<Planar>& to) const requires(kRod);
  void slope_in_pull(const std::vector<Control>& controls, InputSlopes<Planar>& to) const requires(!kRod);
  void slope_in_both(const std::vector<Control>& controls, InputSlopes<Planar>& to) const requires(!kRod);
  double slack_curvature(int segment) const;  // of the slacks with their multipliers, in the control

  Robot robot_;
  bool has_free_form_;
  double displacement_ = 0, length_ = 0;  // of a segment: its share of the cable, its backbone [mm]
  typename Law::Bends bends_;
  typename Law::Bends free_bend_;  // a free segment under the last command of free_control
  Command free_command_{{{-1}}, 0};
  Control free_control_{};
  std::vector<State> adjoints_;  // of the upper state of each segment
  RodCables<kControl> cables_;
};

using PlanarPaper = Planar<PaperLaw>;
using PlanarRod = Planar<RodLaw>;

}  // namespace ccr
