// The robot in the plane at one trial shape: kinematics and objective, with their derivatives.
#pragma once

#include <vector>

#include "math/riccati.hpp"
#include "model/robot.hpp"
#include "model/segment.hpp"

namespace ccr {

// Dynamics of a segment in its lower state: the identity, and the motion of the next node per turn of the disk.
struct Turn {
  double x, y;
};

template <int N>
Vec<N> times(const Turn& a, Vec<N> s) {
  s[0] += a.x * s[2];
  s[1] += a.y * s[2];
  return s;
}

template <int R, int N>
Mat<R, N> times(Mat<R, N> m, const Turn& a) {
  for (int r = 0; r < R; ++r) m(r, 2) += m(r, 0) * a.x + m(r, 1) * a.y;
  return m;
}

template <int N, int C>
Mat<N, C> transpose_times(const Turn& a, Mat<N, C> m) {
  for (int c = 0; c < C; ++c) m(2, c) += a.x * m(0, c) + a.y * m(1, c);
  return m;
}

// With one cable, that of the model `Cable` of a segment.
template <class Cable>
class Planar {
 public:
  static constexpr int kSpace = 2, kTurn = 1, kControl = 1, kCables = 1;
  static constexpr int kShears = 1;             // leading controls, the softest
  static constexpr int kState = Cable::kState;  // x, y, disk angle, and with a sliding cable what is taken from it
  static constexpr bool kRod = Cable::kRod;
  static constexpr int kTip = 3;  // slopes of the free tip in the cable: x, y, angle

  using Control = Vec<kControl>;
  using State = Vec<kState>;
  using Frame = Vec<2>;  // direction from the backbone to the cable
  using System = Riccati<kState, kControl, Turn>;

  explicit Planar(const Robot& robot);

  static Position<2> lever(const Frame& frame, const Vec<2>& line) {
    return {{line[0] * frame[0], line[0] * frame[1]}};
  }

  // Shape under a command; false when a coordinate leaves the range of the segment law.
  bool evaluate(const Command<1>& command, const std::vector<Control>& controls);

  // Slope of the Lagrangian, the adjoints of whose other part than the objective start from the node_forces on each
  // node.
  void adjoin(const std::vector<State>& node_forces);
  // Both follow adjoin.
  void curvature(System& system) const;
  Vec<1> displacement_slopes() const;  // of the Lagrangian in the cable displacement

  // The control of every segment of the robot that nothing touches, and with a sliding cable the multiplier of its
  // slack.
  Control free_control(const Command<1>& command);
  double free_slack_multiplier() const requires(kRod) { return 2 * free_control_[0] / free_bend_[0].taken_slope; }
  Vec<kTip> free_slopes(const Command<1>& command);

  double slack(const Command<1>& command) const requires(kRod) { return states.back()[kState - 1] - command.cables[0]; }
  DiskGap disk_gap(int segment, int side) const requires(kRod);  // 1 for the cable's side, -1 for the other
  double widest_shear() const { return kRod ? HUGE_VAL : 1 - displacement_ / length_; }  // sine of it
  double free_turn() const { return displacement_ / robot_.offset; }  // of a segment that nothing touches, about
  double segment_length() const { return length_; }

  std::vector<State> states;
  std::vector<Frame> frames;
  std::vector<Control> gradient;
  double objective = 0;
  double max_objective_slope = 0;  // largest slope of the objective alone
  double widest = 0;               // largest angle between consecutive disks

 private:
  Robot robot_;
  double displacement_ = 0, length_ = 0;  // cable displacement and backbone of a segment [mm]
  typename Cable::Bends bends_;
  typename Cable::Bends free_bend_;  // a segment that nothing touches, relaxed under the last command asked about
  Command<1> free_command_{{{-1}}, 0};
  Control free_control_{};
  std::vector<State> adjoints_;  // of the state each segment leads to
};

}  // namespace ccr
