#include "solve/continuation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/models.hpp"
#include "solve/sweep.hpp"

namespace ccr {

using namespace tolerances;

namespace {

template <int C>
Command<C> between(const Command<C>& a, const Command<C>& b, double t) {
  Command<C> out;
  for (int k = 0; k < C; ++k) out.cables[k] = a.cables[k] + t * (b.cables[k] - a.cables[k]);
  out.length = a.length + t * (b.length - a.length);
  return out;
}

// The largest of some numbers.
template <int C>
double highest(const Vec<C>& values) {
  return *std::max_element(values.v.begin(), values.v.end());
}

template <int C>
double pull(const Vec<C>& cables) {
  double largest = 0;
  for (const double cable : cables.v) largest = std::max(largest, std::abs(cable));
  return largest;
}

// By loops, which for so few numbers are faster than the calls that copies become.
template <std::size_t N>
void read(const double*& block, std::array<double, N>& numbers) {
  for (double& number : numbers) number = *block++;
}

template <std::size_t N>
void write(const std::array<double, N>& numbers, double*& block, std::size_t count = N) {
  for (std::size_t k = 0; k < count; ++k) *block++ = numbers[k];
}

}  // namespace

// How far apart two commands are, in displacements of a cable [a].
template <class Model>
double Branch<Model>::apart(const Command& a, const Command& b) const {
  const Robot& robot = newton_.chain.robot();
  double farthest = 0;
  for (int k = 0; k < kCables; ++k) farthest = std::max(farthest, std::abs(a.cables[k] - b.cables[k]));
  return std::max(farthest / robot.offset, kInsertion * std::abs(a.length - b.length) / robot.max_length);
}

// What the trend is counted by. Several cables move evenly while it lasts.
template <class Model>
double Branch<Model>::travelled(const Command& from, const Command& to) const {
  return kCables == 1 ? to.cables[0] - from.cables[0] : apart(from, to);
}

template <class Model>
Branch<Model>::Branch(const Robot& robot, int obstacles)
    : newton_(robot, obstacles), nodes_(robot.segments + 1), frames_(robot.segments + 1), points_(robot.points()) {
  present_.controls.resize(robot.segments);
  trend_.controls.resize(robot.segments);
}

template <class Model>
void Branch<Model>::enter(std::span<const Obstacle<kSpace>> obstacles) {
  newton_.enter(obstacles);
  trend_.mounts.resize(newton_.chain.mounts());
  present_.mounts.resize(newton_.chain.mounts());
  trial_ = present_;
}

template <class Model>
std::size_t Branch<Model>::block_size() const {
  const std::size_t n = present_.controls.size(), contacts = newton_.chain.contacts();
  const std::size_t points = newton_.chain.points().size(), obstacles = contacts / points;
  const std::size_t of_disks = Model::kRod * n, of_frames = (n + 1) * Frame{}.v.size(), of_trend = n * Model::kControl + kSpace * obstacles + kMaxActive;
  return 2 * kCables + 2 + n * Model::kControl + 3 * (n + 1) + of_frames + 2 * contacts + kSpace * (2 * obstacles + 1) + 1 +
         kCables + Model::kTip + points + of_disks + kTrend * of_trend;
}

template <class Model>
void Branch<Model>::load(const double* block) {
  const Chain& chain = newton_.chain;
  const int obstacles = static_cast<int>(chain.obstacles().size()), points = static_cast<int>(points_.size());
  read(block, present_.command.cables.v);
  present_.command.length = *block++;
  read(block, tensions_.v);
  energy_ = *block++;
  for (auto& control : present_.controls) read(block, control.v);
  for (Position& node : nodes_) {
    for (int k = 0; k < kSpace; ++k) node[k] = block[k];
    block += 3;
  }
  for (Frame& frame : frames_) read(block, frame.v);
  const double* multipliers = block;
  block += 2 * chain.contacts();
  const auto read_mounts = [&](std::vector<Position>& mounts) {
    for (int j = 0; j < obstacles; ++j, block += kSpace)
      if (const int mount = chain.mount_of(j); mount >= 0) std::copy_n(block, kSpace, mounts[mount].v.begin());
  };
  read_mounts(present_.mounts);
  mounts_ = present_.mounts;
  energy_ += newton_.chain.spring_energy(present_.mounts, present_.command.length);
  newton_.chain.look_around(nodes_, present_.mounts);
  place_points<Model>(chain.robot(), nodes_, frames_, points_);
  block += kSpace * (obstacles + 1) + 1;
  read(block, onset_.v);
  block += Model::kTip;
  ActiveSet& active = present_.active;
  active.count = 0;
  if (std::find(block, block + points, 1.0) != block + points)
    for (int c = 0; c < chain.contacts(); ++c)
      if (block[c % points] != 0 && multipliers[c] > 0 && active.count < kMaxActive) {
        active.contact[active.count] = c;
        active.multiplier[active.count++] = multipliers[c];
      }
  block += points;
  const auto add = [&](int contact, double multiplier) {
    if (active.count == kMaxActive) return;
    active.contact[active.count] = contact;
    active.multiplier[active.count++] = multiplier;
  };
  if (Model::kRod) {
    if (tensions_[0] > 0) add(chain.slack(), tensions_[0] / chain.robot().stiffness(present_.command.length));
    for (int i = 0; i < chain.robot().segments; ++i, ++block)
      if (*block != 0) add(chain.disks() + 2 * i + (*block < 0), std::abs(*block));
  }
  settled_ = false;
  touched_ = chain.touching(active);
  if (!kTrend) return forget();
  for (auto& control : trend_.controls) read(block, control.v);
  read_mounts(trend_.mounts);
  read(block, trend_.multipliers);
}

template <class Model>
void Branch<Model>::store(double* block) {
  Chain& chain = newton_.chain;
  const ActiveSet& active = present_.active;
  const auto write = [&](const auto& numbers) { ccr::write(numbers.v, block); };
  write(present_.command.cables);
  *block++ = present_.command.length;
  write(tensions_);
  *block++ = chain.objective();
  for (const auto& control : present_.controls) write(control);
  for (const auto& state : chain.states()) ccr::write(state.v, block, 3);
  for (const Frame& frame : chain.frames()) write(frame);
  std::fill_n(block, chain.contacts(), 0.0);
  for (int j = 0; j < active.count; ++j)
    if (active.contact[j] < chain.contacts()) block[active.contact[j]] = active.multiplier[j];
  block += chain.contacts();
  chain.survey(block);
  const double clearance = lowest(chain.contacts(), [&](int c) { return block[c]; });
  block += chain.contacts();
  const int obstacles = static_cast<int>(chain.obstacles().size());
  const auto write_mounts = [&](const std::vector<Position>& mounts) {
    for (int j = 0; j < obstacles; ++j) write(chain.mount_of(j) < 0 ? Position{} : mounts[chain.mount_of(j)]);
  };
  write_mounts(present_.mounts);
  Position total{};
  for (int j = 0; j < obstacles; ++j) {
    const Position force = chain.push(active, j);
    total += force;
    write(force);
  }
  write(total);
  *block++ = clearance;
  write(onset_);
  write(chain.free_slopes(present_.command));
  const std::size_t points = chain.points().size();
  std::fill_n(block, points, 0.0);
  for (int j = 0; j < active.count; ++j)
    if (active.contact[j] < chain.contacts()) block[active.contact[j] % points] = 1;
  block += points;
  if (Model::kRod) {  // of the disks that meet, with the sign of the angle between them
    const int n = chain.robot().segments;
    std::fill_n(block, n, 0.0);
    for (int j = 0; j < active.count; ++j)
      if (const int disk = active.contact[j] - chain.disks(); disk >= 0)
        block[disk / 2] = disk % 2 == 0 ? active.multiplier[j] : -active.multiplier[j];
    block += n;
  }
  if (!kTrend) return;
  for (const auto& control : trend_.controls) write(control);
  write_mounts(trend_.mounts);
  std::fill_n(block, kMaxActive, 0.0);
  const auto begin = active.contact.begin(), end = begin + active.count;
  for (int j = 0; j < active.count; ++j) {
    const auto rank = std::count_if(begin, end, [&](int contact) { return contact < begin[j]; });
    block[rank] = trend_.multipliers[j];
  }
}

template <class Model>
void Branch<Model>::remember() {
  points_ = newton_.chain.points();
  mounts_ = present_.mounts;
  if (!trace) return;
  const Chain& chain = newton_.chain;
  for (const auto& s : chain.states()) trace->insert(trace->end(), s.v.begin(), s.v.begin() + 3);
  for (const Position& point : points_) trace->insert(trace->end(), point.v.begin(), point.v.end());
  for (std::size_t j = 0; j < chain.obstacles().size(); ++j) {
    const int mount = chain.mount_of(static_cast<int>(j));
    const Position moved = mount < 0 ? Position{} : mounts_[mount];
    trace->insert(trace->end(), moved.v.begin(), moved.v.end());
  }
}

template <class Model>
void Branch<Model>::hold_last(const Iterate& held) {
  held_ = held;
  exceeded_ = true;
}

template <class Model>
void Branch<Model>::accept() {
  learn();
  const double limit = newton_.chain.robot().max_tension;
  if (highest(tensions_) <= limit && highest(trial_tensions_) > limit) hold_last(present_);
  std::swap(present_, trial_);
  tensions_ = trial_tensions_;
  energy_ = newton_.chain.energy();
  settled_ = true;
  remember();
}

template <class Model>
void Branch<Model>::learn() {
  const ActiveSet &before = present_.active, &now = trial_.active;
  const double pulled = travelled(present_.command, trial_.command);
  forget();
  if (pulled == 0 || trial_.command.length != present_.command.length || !newton_.chain.touching(now) ||
      before.count != now.count || !std::equal(now.contact.begin(), now.contact.begin() + now.count, before.contact.begin()))
    return;
  const auto slope = [&](const auto& now, const auto& before, auto& slope) {
    for (std::size_t k = 0; k < slope.v.size(); ++k) slope[k] = (now[k] - before[k]) / pulled;
  };
  for (std::size_t i = 0; i < trend_.controls.size(); ++i)
    slope(trial_.controls[i], present_.controls[i], trend_.controls[i]);
  for (std::size_t m = 0; m < trend_.mounts.size(); ++m) slope(trial_.mounts[m], present_.mounts[m], trend_.mounts[m]);
  for (int j = 0; j < now.count; ++j) trend_.multipliers[j] = (now.multiplier[j] - before.multiplier[j]) / pulled;
}

template <class Model>
void Branch<Model>::forget() {
  std::fill(trend_.controls.begin(), trend_.controls.end(), typename Model::Control{});
  std::fill(trend_.mounts.begin(), trend_.mounts.end(), Position{});
  trend_.multipliers.fill(0);
}

// From `present_` along the trend.
template <class Model>
void Branch<Model>::predict() {
  steady_ = false;
  const double pulled = travelled(present_.command, trial_.command);
  const auto go_on = [&](auto& at, const auto& slope) {
    for (std::size_t k = 0; k < slope.v.size(); ++k) at[k] += pulled * slope[k];
  };
  for (std::size_t i = 0; i < trend_.controls.size(); ++i) {
    go_on(trial_.controls[i], trend_.controls[i]);
    steady_ |= trial_.controls[i].v != present_.controls[i].v;
  }
  predicted_ = trial_.controls;
  for (std::size_t m = 0; m < trend_.mounts.size(); ++m) go_on(trial_.mounts[m], trend_.mounts[m]);
  for (int j = 0; j < trial_.active.count; ++j)
    trial_.active.multiplier[j] = std::max(0.0, trial_.active.multiplier[j] + pulled * trend_.multipliers[j]);
}

template <class Model>
void Branch<Model>::settle() {
  if (settled_) return;
  newton_.chain.evaluate(present_);
  newton_.chain.reduced_gradient(present_.active);
  tensions_ = newton_.chain.tensions(present_.active);
  energy_ = newton_.chain.energy();
  settled_ = true;
}

// How far points and mounts have come from the last accepted shape at most [mm].
template <class Model>
double Branch<Model>::farthest() const {
  const Chain& chain = newton_.chain;
  double farthest = 0, shift = 0;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const Position move = minus(chain.points()[k], points_[k]);
    farthest = std::max(farthest, dot(move, move));
  }
  for (std::size_t m = 0; m < trial_.mounts.size(); ++m) {
    const Position move = minus(trial_.mounts[m], mounts_[m]);
    shift = std::max(shift, dot(move, move));
  }
  return std::sqrt(farthest) + std::sqrt(shift);
}

// Whether the robot came here from the last accepted shape without passing through an obstacle.
template <class Model>
bool Branch<Model>::passable(double moved) const {
  const Chain& chain = newton_.chain;
  const std::vector<double>& edges = chain.robot().edges;
  const double longest = *std::max_element(edges.begin(), edges.end());
  for (int j = 0; j < static_cast<int>(chain.obstacles().size()); ++j) {
    const auto& obstacle = chain.obstacles()[j];
    if (chain.far(j, moved)) continue;
    if (moved <= harmless_path(obstacle) && moved <= harmless_motion(obstacle, longest)) continue;
    if (!unswept(j, moved)) return false;
  }
  return true;
}

template <class Model>
bool Branch<Model>::unswept(int j, double moved) const {
  const Chain& chain = newton_.chain;
  const Robot& robot = chain.robot();
  const auto& obstacle = chain.obstacles()[j];
  const double* gaps = chain.gaps().data() + j * points_.size();
  const int mount = chain.mount_of(j);
  const Position before = mount < 0 ? Position{} : mounts_[mount], now = mount < 0 ? Position{} : trial_.mounts[mount];
  const double path = harmless_path(obstacle);
  const auto from = [&](int k) { return minus(points_[k], before); };
  const auto to = [&](int k) { return minus(chain.points()[k], now); };
  const auto away = [&](int k) {  // all the way; a gap out of reach is not measured
    return std::isfinite(gaps[k]) ? distance_outside(obstacle, gaps[k]) >= moved : clearance_beyond(obstacle, to(k), moved) > 0;
  };
  for (int line = 0, first = 0; line < static_cast<int>(robot.lines.size()); ++line, first += robot.positions()) {
    const double longest = robot.edges[line];
    const bool edges = moved > harmless_motion(obstacle, longest);
    for (int k = first; k < first + robot.positions(); ++k) {
      if (!obstacle.touchable[k]) continue;
      if (!away(k) && norm(minus(to(k), from(k))) > path && !path_clear(obstacle, from(k), to(k))) return false;
      if (!edges || k + 1 == first + robot.positions() || !obstacle.touchable[k + 1] || (away(k) && away(k + 1))) continue;
      if (!edge_clear<kSpace>(obstacle, {from(k), from(k + 1)}, {to(k), to(k + 1)}, longest / 2)) return false;
    }
  }
  return true;
}

template <class Model>
bool Branch<Model>::attempt_free() {
  if (newton_.chain.touching(trial_.active)) return false;
  newton_.chain.relax(trial_);
  return newton_.chain.evaluate(trial_) && newton_.chain.violation() <= kFeasibility * newton_.chain.robot().max_length;
}

// Leaves in `trial_` the equilibrium under another command, if it continues the branch from `present_`.
template <class Model>
Branch<Model>::Move Branch<Model>::attempt(const Command& command) {
  settled_ = false;
  trial_ = present_;
  trial_.command = command;
  if (!attempt_free()) {
    if (!Model::kRod && pull(command.cables) <= 0) return Move::kRejected;
    predict();
    const bool patient = apart(present_.command, command) <= kPatientStep;
    const Verdict verdict = newton_.solve(trial_, patient ? kDampedIterations : 0);
    iterations += verdict.iterations;
    if (!verdict.converged) return Move::kRejected;
  }
  const double moved = farthest(), length = newton_.chain.robot().max_length, size = apart(present_.command, command);
  const bool contact = newton_.chain.touching(trial_.active) || newton_.chain.touching(present_.active);
  if (size > kMeetingStep && meets_narrow()) return Move::kRejected;
  const double allowed = contact ? std::min(kMoveOffset + kMoveSlope * size, kMoveLargest) : kMoveLargest;
  if (moved > length * allowed || !passable(moved)) return Move::kRejected;
  newton_.chain.reduced_gradient(trial_.active);
  trial_tensions_ = newton_.chain.tensions(trial_.active);
  if (jumped(command, moved)) return Move::kRejected;
  const double tension = highest(trial_tensions_);
  const bool pulled = pulls(command) && command.length == present_.command.length;
  const bool rising = pulled || (!releases(command) && tension > highest(tensions_));
  const double limit = newton_.chain.robot().max_tension;
  if (rising && tension > limit) return Move::kOverTension;
  // The tension may rise above the limit on the way and sink again: by at most twice the mean of what it is above the
  // straight line between its ends, which the cables worked more than that line tells.
  const double hump = std::max(0.0, -lost(command)) * 2 * newton_.chain.stiffness() / (size * newton_.chain.robot().offset);
  const bool peaks = pulled && std::max(tension, highest(tensions_)) + hump > limit;
  return peaks && size > kPeakStep ? Move::kRejected : Move::kAccepted;
}

// Whether between `present_` and `trial_` an obstacle was met that is narrower than the distance of neighbouring points:
// which of them meets it first decides where the robot goes from there.
template <class Model>
bool Branch<Model>::meets_narrow() const {
  const Chain& chain = newton_.chain;
  const std::vector<double>& edges = chain.robot().edges;
  const double spacing = *std::min_element(edges.begin(), edges.end());
  const ActiveSet &before = present_.active, &now = trial_.active;
  const auto begin = before.contact.begin(), end = begin + before.count;
  return std::any_of(now.contact.begin(), now.contact.begin() + now.count, [&](int contact) {
    return contact < chain.contacts() && chain.obstacles()[contact / points_.size()].inradius < spacing &&
           std::find(begin, end, contact) == end;
  });
}

// Energy that is not accounted for by the work of the cables, their tension taken to change evenly on the way from
// `present_` to `trial_` [rad^2].
template <class Model>
double Branch<Model>::lost(const Command& command) const {
  double work = 0;
  for (int k = 0; k < kCables; ++k) {
    const double pulled = std::abs(command.cables[k]) - std::abs(present_.command.cables[k]);
    work += (tensions_[k] + trial_tensions_[k]) / 2 * pulled;
  }
  return work / newton_.chain.stiffness() - (newton_.chain.energy() - energy_);
}

// Whether the robot came to `trial_` by a jump, and not along its branch: it went elsewhere than the trend tells, energy
// was lost on the way, and the way back does not lead to where it came from.
template <class Model>
bool Branch<Model>::jumped(const Command& command, double moved) {
  const Chain& chain = newton_.chain;
  if (moved <= kStill * chain.robot().max_length) return false;
  if (!chain.touching(present_.active) || tight()) return false;  // a free robot has but one branch, one held tight no room
  if (steady_) {
    double turned = 0, missed = 0;
    for (std::size_t i = 0; i < predicted_.size(); ++i)
      for (int k = 0; k < Model::kControl; ++k) {
        turned = std::max(turned, std::abs(predicted_[i][k] - present_.controls[i][k]));
        missed = std::max(missed, std::abs(trial_.controls[i][k] - predicted_[i][k]));
      }
    if (missed <= kOffTrend * turned) return false;
  }
  if (command.length == present_.command.length) {
    double bent = 0;  // work that a tension which changes unevenly may take or give
    for (int k = 0; k < kCables; ++k)
      bent += std::abs(std::abs(command.cables[k]) - std::abs(present_.command.cables[k])) *
              (kUneven * std::abs(trial_tensions_[k] - tensions_[k]) + kLost * std::max(tensions_[k], trial_tensions_[k]));
    if (std::abs(lost(command)) * chain.stiffness() <= bent) return false;
  }
  return !returns();
}

// Whether the way back from `trial_` leads to `present_`. Leaves the chain evaluated at `trial_`.
template <class Model>
bool Branch<Model>::returns() {
  back_ = trial_;
  back_.command = present_.command;
  const Verdict verdict = newton_.solve(back_, 0);
  iterations += verdict.iterations;
  double apart = verdict.converged ? 0 : HUGE_VAL, moved = 0;
  for (std::size_t i = 0; i < back_.controls.size(); ++i)
    for (int k = 0; k < Model::kControl; ++k) {
      apart = std::max(apart, std::abs(back_.controls[i][k] - present_.controls[i][k]));
      moved = std::max(moved, std::abs(trial_.controls[i][k] - present_.controls[i][k]));
    }
  newton_.chain.evaluate(trial_);
  newton_.chain.reduced_gradient(trial_.active);
  return apart <= kReturned * moved;
}

// Whether a command pulls a cable.
template <class Model>
bool Branch<Model>::pulls(const Command& command) const {
  for (int k = 0; k < kCables; ++k)
    if (std::abs(command.cables[k]) > std::abs(present_.command.cables[k])) return true;
  return false;
}

// Whether a command only lets cables out.
template <class Model>
bool Branch<Model>::releases(const Command& command) const {
  return !pulls(command) && command.length == present_.command.length && !(command == present_.command);
}

// `present_` is below the tension limit, `trial_` above: close in from below by false position (Illinois), aiming into
// the middle of the accepted band. False when the branch cannot be followed that far.
template <class Model>
bool Branch<Model>::approach_limit() {
  const double aim = newton_.chain.robot().max_tension * (1 - kTensionBand / 2);
  const Command start = present_.command, end = trial_.command;
  const double span = apart(start, end);
  double low = 0, high = 1;  // fractions of the way
  double excess = highest(trial_tensions_) - aim, shortage = highest(tensions_) - aim;
  Move last = Move::kRejected;
  for (int i = 0; i < kStallIterations && !at_limit(); ++i) {
    const double width = high - low;
    if (!(width * span > kCommandResolution)) break;
    const double middle = std::clamp(high - width * excess / (excess - shortage), low + 1e-3 * width, high - 1e-3 * width);
    const Move move = attempt(between(start, end, middle));
    if (move == Move::kRejected) return false;
    if (move == Move::kAccepted) {
      accept();
      low = middle;
      shortage = highest(tensions_) - aim;
      if (move == last) excess /= 2;
    } else {
      high = middle;
      excess = highest(trial_tensions_) - aim;
      if (move == last) shortage /= 2;
    }
    last = move;
  }
  return true;
}

// The quadratic end of a descent, where Newton's method stays close and loses energy.
template <class Model>
bool Branch<Model>::finish() {
  const double energy = newton_.chain.energy();
  trial_ = present_;
  newton_.chain.fence(false);
  const Verdict verdict = newton_.solve(trial_, 0);
  newton_.chain.fence(true);
  iterations += verdict.iterations;
  if (!verdict.converged || newton_.chain.energy() > energy || !close_by()) return false;
  std::swap(present_, trial_);
  remember();
  return true;
}

// One iterate of the descent from `present_` to `trial_`, so short that nothing is jumped over. True at an equilibrium.
template <class Model>
bool Branch<Model>::descend(bool& moved) {
  double cap = kDescentCap;
  for (int shortening = 0; shortening < kDescentShortenings; ++shortening, cap /= 4) {
    trial_ = present_;
    ++iterations;
    if (newton_.descend(trial_, cap, moved).converged) return true;
    if (!moved || close_by()) return false;
  }
  moved = false;
  return false;
}

// Leaves in `trial_` the feasible shape closest to `present_` under a command, with the active gaps held closed or not.
template <class Model>
bool Branch<Model>::depart(const Command& command, bool holding) {
  trial_ = present_;
  trial_.command = command;
  if (!holding) trial_.active.count = 0;
  return newton_.restore(trial_) && close_by();
}

// The same a part of the way to a command, where it need not be as far.
template <class Model>
bool Branch<Model>::leave(const Command& command) {
  for (double part = 1; part >= kSmallestPart; part /= 8) {
    const Command nearer = between(present_.command, command, part);
    if (depart(nearer, true) || depart(nearer, false)) return true;
  }
  return false;
}

// Whether an iterate of the descent is near the last one, and nothing was passed through on the way.
template <class Model>
bool Branch<Model>::close_by() const {
  const double moved = farthest();
  return moved <= kDescentMove * newton_.chain.robot().max_length && passable(moved);
}

// The branch ends within the smallest step: descend from its end, feasible and slowly, to where the robot goes.
template <class Model>
Branch<Model>::End Branch<Model>::pass_end(const Command& command) {
  start_ = present_;
  const bool holding = !releases(command);  // the motor
  start_points_ = points_;
  start_mounts_ = mounts_;
  const std::size_t start_trace = trace ? trace->size() : 0;
  settled_ = false;
  const auto undo = [&](End reason) {
    newton_.chain.fence(false);
    present_ = start_;
    points_ = start_points_;
    mounts_ = start_mounts_;
    if (trace) trace->resize(start_trace);
    settled_ = false;
    settle();
    return reason;
  };

  newton_.chain.fence(true);
  bool moved = newton_.measure(present_) && leave(command), folded = false;
  for (int i = 0; i < kDescentIterations && moved && !spent(); ++i) {
    std::swap(present_, trial_);
    remember();
    const bool finished = i % kFinishEvery == kFinishEvery - 1 && finish();
    const bool ended = finished || descend(moved);
    folded = !finished && newton_.chain.at_fence();
    if (!ended) continue;
    if (folded && !finish()) break;
    newton_.chain.fence(false);
    settled_ = false;
    forget();
    settle();
    if (highest(tensions_) > newton_.chain.robot().max_tension) {
      if (holding) return undo(End::kOverTension);
      hold_last(start_);
    }
    double farthest = 0;
    for (std::size_t k = 0; k < points_.size(); ++k)
      farthest = std::max(farthest, norm(minus(points_[k], start_points_[k])));
    return farthest > kStill * newton_.chain.robot().max_length ? End::kSnapped : End::kPassed;
  }
  reason = spent() ? Reason::kWork : folded ? Reason::kFolded : Reason::kStuck;
  return undo(End::kStuck);
}

template <class Model>
bool Branch<Model>::at_limit() const {
  return highest(tensions_) >= newton_.chain.robot().max_tension * (1 - kTensionBand);
}

// Where a command leads: a robot that touches is not slackened below its pretension where the cables alone give it its
// shape.
template <class Model>
Branch<Model>::Command Branch<Model>::goal(Command wanted) const {
  const double pretension = kPretension * newton_.chain.robot().offset;
  if (Model::kRod || pull(wanted.cables) >= pretension || !newton_.chain.touching(present_.active)) return wanted;
  int taut = 0;
  for (int k = 1; k < kCables; ++k)
    if (std::abs(present_.command.cables[k]) > std::abs(present_.command.cables[taut])) taut = k;
  const double present = present_.command.cables[taut];
  const double least = std::min(std::abs(present), pretension);
  if (std::abs(wanted.cables[taut]) < least) wanted.cables[taut] = std::copysign(least, present);
  return wanted;
}

// Gives up pulling the cables that are at the tension limit, or else all that are pulled; false where there is but one.
template <class Model>
bool Branch<Model>::hold(Command& wanted) const {
  if (kCables == 1) return false;
  const auto give_up = [&](double tension) {
    bool held = false;
    for (int k = 0; k < kCables; ++k) {
      const double present = present_.command.cables[k];
      if (tensions_[k] < tension || std::abs(wanted.cables[k]) <= std::abs(present)) continue;
      wanted.cables[k] = present;
      held = true;
    }
    return held;
  };
  return give_up(newton_.chain.robot().max_tension * (1 - kTensionBand)) || give_up(-HUGE_VAL);
}

// Lets out, by at least so much, the cables whose motors cannot hold them; false where they go farther by themselves.
template <class Model>
bool Branch<Model>::yield(Command& wanted, double least) const {
  bool changed = false;
  for (int k = 0; k < kCables; ++k) {
    const double present = present_.command.cables[k];
    const double held = std::max(std::abs(present) - least * newton_.chain.robot().offset, 0.0);
    if (tensions_[k] <= newton_.chain.robot().max_tension || present == 0 || wanted.cables[k] / present <= held / std::abs(present))
      continue;
    wanted.cables[k] = std::copysign(held, present);
    changed = true;
  }
  return changed;
}

// Whether a cable that its motor cannot hold has no more to let out.
template <class Model>
bool Branch<Model>::unyielding() const {
  for (int k = 0; k < kCables; ++k)
    if (tensions_[k] > newton_.chain.robot().max_tension && present_.command.cables[k] == 0) return true;
  return false;
}

// Whether to first order no motion of the robot meets the command: the multipliers that hold it, or that of the gap it
// would run into, balance each other without the energy of the robot, as they do where the tension grows beyond bounds.
template <class Model>
bool Branch<Model>::barred(const Command& command) {
  Chain& chain = newton_.chain;
  ActiveSet holding = present_.active;
  if (holding.count > 0 && !tight() && std::isfinite(chain.robot().max_tension)) return false;
  if (holding.count == 0) {
    trial_ = present_;
    trial_.command = command;
    if (!chain.evaluate(trial_)) return false;
    for (const int contact : chain.near())
      if (chain.gaps()[contact] < (holding.count == 0 ? 0.0 : chain.gaps()[holding.contact[0]])) {
        holding.count = 1;
        holding.contact[0] = contact;
        holding.multiplier[0] = 1;
      }
  }
  settled_ = false;
  if (holding.count == 0 || !chain.evaluate(present_)) return false;
  double pressed = 0, balance = 0;
  for (int j = 0; j < holding.count; ++j)
    pressed = std::max(pressed, holding.multiplier[j] * chain.lever_arm(holding.contact[j]));
  chain.reduced_gradient({});
  std::vector<typename Model::Control> slope = chain.gradient();
  chain.reduced_gradient(holding);
  for (std::size_t i = 0; i < slope.size(); ++i)
    for (int k = 0; k < Model::kControl; ++k) balance = std::max(balance, std::abs(chain.gradient()[i][k] - slope[i][k]));
  for (std::size_t m = 0; m < present_.mounts.size(); ++m) {
    Position pushed{};
    for (int j = 0; j < holding.count; ++j)
      if (chain.mount(holding.contact[j]) == static_cast<int>(m)) {
        const auto normal = chain.slope(holding.contact[j]).normal;
        for (int k = 0; k < kSpace; ++k) pushed[k] += holding.multiplier[j] * normal[k];
      }
    balance = std::max(balance, chain.robot().max_length / chain.robot().segments * norm(pushed));
  }
  return balance <= kBarred * pressed;
}

// As tensions grow beyond all that a robot needs to bend, its geometry begins to bar it, ever more closely.
template <class Model>
bool Branch<Model>::tight() const {
  const Robot& robot = newton_.chain.robot();
  return highest(tensions_) > kTight * robot.rigidity / (robot.offset * robot.max_length);
}

template <class Model>
Status Branch<Model>::follow(const Command& target) {
  Status reached = Status::kConverged;
  Command wanted = target;
  double step = kLargestStep, yielding = kYield;
  bool refined = false;  // the last attempt was rejected: do not grow again at once
  const double limit = newton_.chain.robot().max_tension;
  const int steps = kSubSteps + static_cast<int>(2 * apart(present_.command, target) / kLargestStep);
  for (int sub = 0, ends = 0; sub < steps && ends < kBranchEnds && !spent(); ++sub) {
    // A release may lead to more tension than a motor holds: it yields until it holds again.
    if (highest(tensions_) > limit) {
      if (yield(wanted, yielding)) {
        reached = std::max(reached, Status::kStalled);
        forget();
        yielding *= 2;
      } else if (unyielding()) {
        return Status::kStalled;
      }
    } else {
      yielding = kYield;
    }
    const Command goal = this->goal(wanted);
    const double remaining = apart(present_.command, goal);
    if (remaining == 0) return reached;
    bool stalled = kCables == 1 && at_limit() && pulls(goal) && goal.length == present_.command.length;
    const double size = step >= remaining - kCommandResolution ? remaining : step;  // leaves no rest to round off
    const Command next = size == remaining ? goal : between(present_.command, goal, size / remaining);
    const Move move = stalled ? Move::kOverTension : attempt(next);
    if (move == Move::kAccepted) {
      accept();
      step = refined ? size : std::min(2 * size, kLargestStep);
      refined = false;
    } else if (move == Move::kOverTension) {
      stalled = stalled || approach_limit();
      step = size / 2;
    } else if (size > kSmallestStep || (size > kTightStep && tight() && !barred(next))) {
      step = size / 2;
      refined = true;
    } else {
      const End end = pass_end(next);
      if (end == End::kStuck) return barred(next) ? Status::kBlocked : Status::kGaveUp;
      stalled = end == End::kOverTension;
      if (end == End::kSnapped) reached = std::max(reached, Status::kSnapped);
      step = 2 * kSmallestStep;
      refined = false;
      ++ends;
    }
    if (stalled) {
      reached = std::max(reached, Status::kStalled);
      if (!hold(wanted)) return reached;
      forget();
    }
  }
  reason = Reason::kWork;
  return Status::kGaveUp;
}

// Tensions of the free robot where it first touches, between where the step began and where it is, each with the sign of
// its displacement.
template <class Model>
Branch<Model>::Tensions Branch<Model>::first_tensions(const Command& start) {
  const auto clear = [&](double part) {
    trial_.command = between(start, present_.command, part);
    newton_.chain.relax(trial_);
    return newton_.chain.evaluate(trial_) && newton_.chain.violation() <= kFeasibility * newton_.chain.robot().max_length;
  };
  double low = 0, high = 1;
  if (!clear(high))
    for (int i = 0; i < kOnsetBisections; ++i) {
      const double middle = (low + high) / 2;
      (clear(middle) ? low : high) = middle;
    }
  clear(high);
  newton_.chain.reduced_gradient(trial_.active);
  Tensions tensions = newton_.chain.tensions(trial_.active);
  for (int k = 0; k < kCables; ++k)
    if (trial_.command.cables[k] < 0) tensions[k] = -tensions[k];
  return tensions;
}

template <class Model>
Status Branch<Model>::follow(const double* from, const double* target, double* to) {
  iterations = 0;
  reason = Reason::kNone;
  work_before_ = newton_.work();
  exceeded_ = false;
  load(from);
  const Command start = present_.command;
  Command wanted;
  read(target, wanted.cables.v);
  wanted.length = *target;
  if (trace) {
    settle();
    remember();
  }
  const Status status = follow(wanted);
  if (exceeded_ && highest(tensions_) > newton_.chain.robot().max_tension) {  // amid a yield
    present_ = held_;
    settled_ = false;
    settle();
    remember();
  }
  if (!newton_.chain.touching(present_.active)) {
    onset_ = {};
  } else if (!touched_) {
    onset_ = first_tensions(start);
    settled_ = false;
  }
  settle();
  factorizations = static_cast<int>(newton_.work() - work_before_);
  if (!std::isfinite(newton_.chain.objective())) {  // the coordinates it began with are none a robot can have
    if (to != from) std::copy_n(from, block_size(), to);
    return Status::kGaveUp;
  }
  store(to);
  return status;
}

template <class Model>
Optimality Branch<Model>::optimality(const double* block) {
  load(block);
  settle();
  Chain& chain = newton_.chain;
  Optimality found;
  const double length = chain.robot().max_length;
  for (const auto& g : chain.gradient())
    for (const double slope : g.v) found.stationarity = std::max(found.stationarity, std::abs(slope));
  for (const auto& g : chain.mount_gradient())
    found.stationarity = std::max(found.stationarity, length / chain.robot().segments * norm(g));
  found.gap = chain.violation() / length;
  for (int j = 0; j < present_.active.count; ++j) {
    const double gap = std::abs(chain.gaps()[present_.active.contact[j]]);
    found.gap = std::max(found.gap, gap / length);
    found.complementarity = std::max(found.complementarity, gap * present_.active.multiplier[j]);
  }
  return found;
}

template <class Model>
bool Branch<Model>::reaches(double force, int obstacle, const double* direction, double increment, double limit,
                            double length, double* reached) {
  std::fill_n(reached, kSpace, 0.0);
  if (!(increment > 0)) return false;
  Command command{{}, length};
  std::vector<double> rest(block_size());
  rest[kCables] = length;
  Vec<kCables + 1> straight{};
  straight[kCables] = length;
  follow(rest.data(), straight.v.data(), rest.data());
  if (newton_.chain.violation() > 0) return false;
  load(rest.data());
  const int obstacles = static_cast<int>(newton_.chain.obstacles().size());
  for (int i = 1; i * increment < limit; ++i) {
    for (int k = 0; k < kCables; ++k) command.cables[k] = i * increment * direction[k];
    work_before_ = newton_.work();
    if (follow(command) != Status::kConverged) return false;
    settle();
    Position total{};
    for (int j = 0; j < obstacles; ++j)
      if (obstacle < 0 || j == obstacle) total += newton_.chain.push(present_.active, j);
    std::copy_n(total.v.begin(), kSpace, reached);
    if (newton_.chain.touching(present_.active) && norm(total) >= force) return true;
  }
  return false;
}

#define CCR_INSTANTIATE(Model) template class Branch<Model>;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

template <>
std::unique_ptr<Follower<2>> make_follower(const Robot& robot, int obstacles) {
  if (robot.sliding) return std::make_unique<Branch<Planar<RodLaw>>>(robot, obstacles);
  return std::make_unique<Branch<Planar<PaperLaw>>>(robot, obstacles);
}

template <>
std::unique_ptr<Follower<3>> make_follower(const Robot& robot, int obstacles) {
  return std::make_unique<Branch<Spatial>>(robot, obstacles);
}

}  // namespace ccr
