// The robot in the plane at one trial shape: kinematics and objective, with their derivatives.
#pragma once

#include <vector>

#include "math/riccati.hpp"
#include "model/robot.hpp"
#include "model/segment.hpp"

namespace ccr {

// Derivative of the upper state of a segment in its lower one: the identity, and the motion of the upper node per
// rotation of the lower disk.
struct PlanarTransition {
  double x, y;
};

template <int N>
Vec<N> times(const PlanarTransition& a, Vec<N> s) {
  s[0] += a.x * s[2];
  s[1] += a.y * s[2];
  return s;
}

template <int R, int N>
Mat<R, N> times(Mat<R, N> m, const PlanarTransition& a) {
  for (int r = 0; r < R; ++r) m(r, 2) += m(r, 0) * a.x + m(r, 1) * a.y;
  return m;
}

template <int N, int C>
Mat<N, C> transpose_times(const PlanarTransition& a, Mat<N, C> m) {
  for (int c = 0; c < C; ++c) m(2, c) += a.x * m(0, c) + a.y * m(1, c);
  return m;
}

// One cable. `Law` is the model of a segment.
template <class Law>
class Planar {
 public:
  static constexpr int kSpace = 2, kTurn = 1, kControl = 1, kCables = 1;
  static constexpr int kShears = 1;  // leading controls that shear a segment
  static constexpr int kState = 3;   // x, y, disk angle
  static constexpr bool kRod = Law::kRod;
  static constexpr int kTip = 3;  // slopes of the free tip: x, y, angle

  using Control = Vec<kControl>;
  using State = Vec<kState>;
  using Frame = Vec<2>;  // direction from the backbone to the cable
  using System = Riccati<kState, kControl, PlanarTransition>;

  explicit Planar(const Robot& robot);

  static Position<2> lever(const Frame& frame, const Vec<2>& line) {
    return {{line[0] * frame[0], line[0] * frame[1]}};
  }

  // Evaluates the shape under a command; false where a control is out of range of the segment law.
  bool evaluate(const Command<1>& command, const std::vector<Control>& controls);

  // Computes the adjoints and the gradient of the Lagrangian J - Σ λ c in the controls; `node_forces` is Σ λ ∇c at
  // each node.
  void propagate_adjoints(const std::vector<State>& node_forces);
  // Hessian of the Lagrangian without that of the gaps; follows propagate_adjoints.
  void lagrangian_hessian(System& system) const;
  Vec<1> displacement_slopes() const;  // of the Lagrangian in the displacement; follows propagate_adjoints

  // Control of every segment of the robot that nothing touches, and for the rod the multiplier of the slack.
  Control free_control(const Command<1>& command);
  double free_slack_multiplier() const requires(kRod) { return 2 * free_control_[0] / free_bend_[0].taken_slope; }
  Vec<kTip> free_slopes(const Command<1>& command);

  // Cable taken up by the bending beyond the displacement [mm], and minus its gradient in the controls.
  double slack(const Command<1>& command) const requires(kRod) { return taken_ - command.cables[0]; }
  const std::vector<Control>& minus_slack_slopes() const requires(kRod) { return minus_taken_slopes_; }
  // Adds the slack with a multiplier to the Lagrangian; follows propagate_adjoints.
  void add_slack(double multiplier) requires(kRod);
  DiskGap disk_gap(int segment, int side) const requires(kRod);  // side 1 is that of the cable, -1 the other
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
  Robot robot_;
  double displacement_ = 0, length_ = 0;  // of a segment: its share of the cable, its backbone [mm]
  typename Law::Bends bends_;
  typename Law::Bends free_bend_;  // a free segment under the last command of free_control
  Command<1> free_command_{{{-1}}, 0};
  Control free_control_{};
  std::vector<State> adjoints_;  // of the upper state of each segment
  double taken_ = 0, slack_multiplier_ = 0;
  std::vector<Control> minus_taken_slopes_;
};

}  // namespace ccr
