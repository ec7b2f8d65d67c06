// How the segments of each model change with the inputs of their laws: cables of the paper's models, and the length.
#include <algorithm>

#include "model/law_slopes.hpp"
#include "model/models.hpp"

namespace ccr {

namespace {

// First and second derivative of the work of a force on a chord in the plane, in the rotation of the chord.
struct Swing {
  template <class Bend, int N>
  Swing(const Vec<N>& p, const Bend& bend)
      : turning(p[1] * bend.dx - p[0] * bend.dy), inward(-(p[0] * bend.dx + p[1] * bend.dy)) {}
  double turning, inward;
};

// Slopes of a segment of the paper's model in an input in which θ has the slopes `angle`, and `slope` in σ as well. The
// chord turns by half of θ back, and grows at the rate `growth`.
template <class Bend, class Slope>
void slope_paper_segment(const Bend& bend, const Vec<3>& p, double angle, double slope, double growth, Slope& to) {
  const Swing swing(p, bend);
  const double heading = -angle / 2;
  to.upper = {{-bend.dy * heading + bend.dx * growth, bend.dx * heading + bend.dy * growth, -angle}};
  to.lower = {{0, 0, swing.inward * heading + swing.turning * growth}};
  to.own[0] = 2 * (bend.slope * angle + bend.angle * slope) - p[2] * slope +
              bend.heading_slope * (swing.inward * heading + swing.turning * growth) - swing.turning * slope / 2;
}

// Second derivative of the Lagrangian of such a segment in two inputs.
template <class Bend>
double paper_curvature(const Bend& bend, const Vec<3>& p, const double (&angle)[2], const double (&growth)[2],
                       double curvature) {
  const Swing swing(p, bend);
  return 2 * (angle[0] * angle[1] + bend.angle * curvature) - p[2] * curvature +
         swing.inward * angle[0] * angle[1] / 4 -
         swing.turning * (curvature + growth[0] * angle[1] + growth[1] * angle[0]) / 2;
}

}  // namespace

template <class Law>
void Planar<Law>::input_slopes(const Command&, const std::vector<Control>& controls, int inputs,
                               InputSlopes<Planar>& to) const {
  to.curvature = {};
  to.slack = {};
  if constexpr (kRod)
    slope_arcs(to);
  else if (inputs == 1)
    slope_in_pull(controls, to);
  else
    slope_in_both(controls, to);
}

// The chord of an arc is proportional to the length.
template <class Law>
void Planar<Law>::slope_arcs(InputSlopes<Planar>& to) const requires(kRod) {
  const double per_length = 1 / (robot_.segments * length_);
  for (int i = 0; i < robot_.segments; ++i) {
    const auto bend = bends_[i];
    const Swing swing(adjoints_[i], bend);
    InputSlope<Planar>& segment = to.segment[0][i];
    segment.upper = {{bend.dx * per_length, bend.dy * per_length, 0}};
    segment.lower = {{0, 0, swing.turning * per_length}};
    segment.own[0] = (swing.turning * bend.heading_slope - swing.inward * bend.stretch) * per_length;
    for (int k = 0; k < cables_.count(); ++k)
      if (cables_.spans(k, i)) {
        segment.own[0] -= cables_.multipliers()[k] * bend.short_slope * per_length;
        to.slack[k] += bend.short_by * per_length;
      }
  }
}

// Segments beyond the last contact are alike.
template <class Law>
void Planar<Law>::slope_in_pull(const std::vector<Control>& controls, InputSlopes<Planar>& to) const requires(!kRod) {
  const double share = 1.0 / robot_.segments;
  PaperPull law{};
  double curvature = 0;
  for (int i = 0; i < robot_.segments; ++i) {
    const auto bend = bends_[i];
    const State& p = adjoints_[i];
    if (i == 0 || controls[i][0] != controls[i - 1][0])
      law = paper_pull(controls[i][0], displacement_, length_, robot_.offset);
    slope_paper_segment(bend, p, law.angle * share, law.slope * share, 0, to.segment[0][i]);
    const Swing swing(p, bend);
    curvature +=
        (2 + swing.inward / 4) * law.angle * law.angle + (2 * bend.angle - p[2] - swing.turning / 2) * law.curvature;
  }
  to.curvature(0, 0) = curvature * share * share;
}

template <class Law>
void Planar<Law>::slope_in_both(const std::vector<Control>& controls, InputSlopes<Planar>& to) const requires(!kRod) {
  const int n = robot_.segments;
  const double growth[2] = {0, 1 / (n * length_)}, each = 1.0 / (n * n);
  PaperInputs law{};
  for (int i = 0; i < n; ++i) {
    const auto bend = bends_[i];
    const State& p = adjoints_[i];
    if (i == 0 || controls[i][0] != controls[i - 1][0])
      law = paper_inputs(controls[i][0], displacement_, length_, robot_.offset);
    const double angle[2] = {law.angle[0] / n, law.angle[1] / n};
    for (int k = 0; k < 2; ++k) slope_paper_segment(bend, p, angle[k], law.slope[k] / n, growth[k], to.segment[k][i]);
    const double curvatures[2][2] = {{law.pull_curvature, law.coupling}, {law.coupling, law.length_curvature}};
    for (int r = 0; r < 2; ++r)
      for (int c = 0; c < 2; ++c)
        to.curvature(r, c) +=
            paper_curvature(bend, p, {angle[r], angle[c]}, {growth[r], growth[c]}, curvatures[r][c] * each);
  }
}

template <class Law>
LengthSlope<Vec<1>> Planar<Law>::disk_length_slope(int segment, int side) const requires(kRod) {
  const double sign = side == 0 ? 1 : -1;
  const auto [value, slope] = ccr::disk_length_slope(sign * bends_[segment].angle);
  return {value / robot_.segments, {{sign * slope / robot_.segments}}};
}

void SpatialPaper::input_slopes(const Command& command, const std::vector<Control>& controls, int inputs,
                                InputSlopes<SpatialPaper>& to) const {
  const double n = robot_.segments;
  double rate[kInputs] = {1 / n, 1 / n, 1 / n};  // of each input of a segment in that of the robot
  for (int k = 0; k < kCables; ++k)
    if (command.cables[k] < 0) rate[k] = -rate[k];
  to.curvature = {};
  for (int i = 0; i < robot_.segments; ++i) {
    const Bend& bend = bends_[i];
    const double bending[] = {bendings_.at(0, i), bendings_.at(1, i)};
    const Wrench& local = wrenches_[i];
    const SpatialInputs law = spatial_inputs(inputs_, controls[i].v.data(), bending, local.force, local.moment);
    const Vec<3> force = times(frames[i], local.force), moment = times(frames[i], local.moment);
    for (int k = 0, entry = 0; k < inputs; ++k) {
      Vec<3> chord, turn;
      for (int c = 0; c < 3; ++c) {
        chord[c] = rate[k] * (k < kCables ? bend.chord_displacement_slope(c, k) : law.chord[c]);
        turn[c] = rate[k] * (k < kCables ? bend.turn_displacement_slope(c, k) : law.turn[c]);
      }
      chord = times(frames[i], chord);
      turn = times(frames[i], turn);
      const Vec<3> swung = cross(chord, force), twisted = cross(turn, moment);
      InputSlope<SpatialPaper>& segment = to.segment[k][i];
      segment.lower = {};
      for (int c = 0; c < 3; ++c) {
        segment.upper[c] = chord[c];
        segment.upper[3 + c] = turn[c];
        segment.lower[3 + c] = swung[c] + twisted[c] / 2;
        segment.own[c] = rate[k] * law.mixed(c, k);
      }
      for (int l = 0; l <= k; ++l, ++entry) {
        to.curvature(k, l) += rate[k] * rate[l] * law.within[entry];
        to.curvature(l, k) = to.curvature(k, l);
      }
    }
  }
}

void SpatialRod::input_slopes(const Command&, const std::vector<Control>& controls, int,
                              InputSlopes<SpatialRod>& to) const {
  const int n = robot_.segments;
  const double per_length = 1 / (n * length_);
  to.slack = {};
  for (int i = 0; i < n; ++i) {  // the chord is proportional to the length
    const Wrench& local = wrenches_[i];
    const Vec<3> swung = cross(chords_[i], times(frames[i], local.force));
    InputSlope<SpatialRod>& segment = to.segment[0][i];
    segment.lower = {};
    for (int c = 0; c < 3; ++c) {
      segment.upper[c] = chords_[i][c] * per_length;
      segment.lower[3 + c] = swung[c] * per_length;
    }
    segment.own = transpose_times(arcs_[i].chord_slope, local.force);
    double shared[ArcLaw::kShared];
    shared_.get(i, shared, ArcLaw::kShared);
    for (int k = 0; k < cables_.count(); ++k) {
      const double multiplier = cables_.multipliers()[k];
      if (multiplier == 0 || !cables_.spans(k, i)) continue;
      const auto [distance, slope] = cable_length_slope(controls[i].v.data(), arc_cables_[k].hole, shared);
      to.slack[k] += (length_ - distance) * per_length;
      for (int c = 0; c < kControl; ++c) segment.own[c] += multiplier * slope[c];
    }
    for (double& slope : segment.own.v) slope *= per_length;
  }
}

LengthSlope<Vec<3>> SpatialRod::disk_length_slope(int segment, int) const {
  const double bent = bend(segment), n = robot_.segments;
  const auto [value, slope] = ccr::disk_length_slope(bent);
  return {value / n,
          {{slope * controls_.at(0, segment) / (bent * n), slope * controls_.at(1, segment) / (bent * n), 0}}};
}

template void Planar<PaperLaw>::input_slopes(const Command&, const std::vector<Control>&, int,
                                             InputSlopes<Planar<PaperLaw>>&) const;
template void Planar<RodLaw>::input_slopes(const Command&, const std::vector<Control>&, int,
                                           InputSlopes<Planar<RodLaw>>&) const;
template LengthSlope<Vec<1>> Planar<RodLaw>::disk_length_slope(int, int) const;

}  // namespace ccr
