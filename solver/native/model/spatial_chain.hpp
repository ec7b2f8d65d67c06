// Kinematics of a chain of segments in space, shared by the models: from one disk to the next, forces back, and the
// blocks of the Hessian. `Bend` holds the outputs of a segment law, in the frame of the lower disk: chord, rotation,
// chord_slope and turn_slope.
#pragma once

#include <algorithm>

#include "math/linalg.hpp"
#include "math/rotations.hpp"

namespace ccr {

// Derivative of the upper state of a segment in its lower one: the identity, and the motion of the end of the chord
// per rotation of the lower disk.
struct SpatialTransition {
  Vec<3> chord;  // in the base frame
};

template <int N, class T>
[[gnu::always_inline]] inline Vec<N, T> times(const SpatialTransition& a, Vec<N, T> s) {
  const Vec<3, T> motion = cross(Vec<3, T>{{s[3], s[4], s[5]}}, a.chord);
  for (int k = 0; k < 3; ++k) s[k] += motion[k];
  return s;
}

template <int R, int N>
void multiply(Mat<R, N>& m, const SpatialTransition& a) {
  for (int r = 0; r < R; ++r) {
    const Vec<3> moment = cross(a.chord, Vec<3>{{m(r, 0), m(r, 1), m(r, 2)}});
    for (int k = 0; k < 3; ++k) m(r, 3 + k) += moment[k];
  }
}

template <int N, int C, class T>
[[gnu::always_inline]] inline Mat<N, C, T> transpose_times(const SpatialTransition& a, Mat<N, C, T> m) {
  for (int c = 0; c < C; ++c) {
    const Vec<3, T> moment = cross(a.chord, Vec<3, T>{{m(0, c), m(1, c), m(2, c)}});
    for (int k = 0; k < 3; ++k) m(3 + k, c) += moment[k];
  }
  return m;
}

inline constexpr Mat<3, 3> kBaseFrame = {{1, 0, 0, 0, 1, 0, 0, 0, 1}};

// Point on a disk, from its center, at a place in its frame.
inline Vec<3> disk_lever(const Mat<3, 3>& frame, const Vec<2>& place) {
  const Pack<2> across{{frame(0, 0), frame(1, 0)}}, along{{frame(0, 1), frame(1, 1)}};
  const Pack<2> level = across * place[0] + along * place[1];
  return {{level.v[0], level.v[1], frame(2, 0) * place[0] + frame(2, 1) * place[1]}};
}

// Finds state and frame of the upper disk of a segment. Returns its chord in the base frame.
template <class Bend>
Vec<3> move_up(const Bend& bend, const Vec<6>& state, const Mat<3, 3>& frame, Vec<6>& next, Mat<3, 3>& next_frame) {
  const Vec<3> chord = times(frame, bend.chord);
  for (int k = 0; k < 3; ++k) next[k] = state[k] + chord[k];  // the turns are 0 throughout
  next_frame = times(frame, bend.rotation);
  return chord;
}

// Adjoint of a state, in the base frame.
struct Wrench {
  Vec<3> force, moment;

  void subtract(const Vec<6>& node_force) {
    for (int k = 0; k < 3; ++k) {
      force[k] -= node_force[k];
      moment[k] -= node_force[3 + k];
    }
  }
  bool acts() const {
    return std::any_of(force.v.begin(), force.v.end(), [](double part) { return part != 0; }) ||
           std::any_of(moment.v.begin(), moment.v.end(), [](double part) { return part != 0; });
  }
  Wrench in(const Mat<3, 3>& frame) const { return {transpose_times(frame, force), transpose_times(frame, moment)}; }
};

// Blocks of the Hessian of a segment in its lower state, and between that and the controls, from the adjoint of its
// upper state in the lower disk's frame.
template <class Bend, class Stage>
void assemble_stage(const Bend& bend, const Vec<3>& chord, const Mat<3, 3>& frame, const Wrench& local, Stage& stage,
                    Mat<6, 6>& node_hessian) {
  stage.a.chord = chord;
  const Mat<3, 3> chord_slope = times(frame, bend.chord_slope), turn_slope = times(frame, bend.turn_slope);
  std::copy_n(turn_slope.v.begin(), 9, std::copy_n(chord_slope.v.begin(), 9, stage.b.v.begin()));
  node_hessian.v.fill(0);
  stage.hux.v.fill(0);
  if (!local.acts()) return;
  const Vec<3> force = times(frame, local.force), moment = times(frame, local.moment);
  const Mat<3, 3> turned = hessian_contraction(chord, force);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) node_hessian(3 + r, 3 + c) = turned(r, c);
  for (int k = 0; k < 3; ++k) {
    const Vec<3> swung = cross(Vec<3>{{chord_slope(0, k), chord_slope(1, k), chord_slope(2, k)}}, force);
    const Vec<3> twisted = cross(Vec<3>{{turn_slope(0, k), turn_slope(1, k), turn_slope(2, k)}}, moment);
    for (int c = 0; c < 3; ++c) stage.hux(k, 3 + c) = swung[c] + twisted[c] / 2;
  }
}

}  // namespace ccr
