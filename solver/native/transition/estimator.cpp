#include "transition/estimator.hpp"

#include <cmath>
#include <utility>

namespace ccr {

namespace {

constexpr double kTiny = 1e-300;  // keeps quotients defined where nothing touches

}  // namespace

template <int D>
Estimator<D>::Estimator(EstimatorSettings settings, const BlockLayout& layout, int count, BatchArrays<D> free,
                        EstimatorArrays arrays)
    : settings_(std::move(settings)),
      layout_(layout),
      free_layout_(free.batch ? free.layout() : layout),
      free_(free),
      arrays_(arrays),
      count_(count),
      companions_(settings_.alike ? 1 : settings_.actuation.commands),
      nodes_(layout.nodes.shape[0]),
      lines_(layout.multipliers.shape[1]),
      positions_(layout.multipliers.shape[2]),
      obstacles_(layout.multipliers.shape[0]) {}

// By how much the companions are pulled more by each command, (companions, commands) [mm].
template <int D>
template <class T>
void Estimator<D>::steps(const T* actuated, T* to) const {
  const int commands = settings_.actuation.commands;
  const double step = settings_.step_mm;
  if (!settings_.alike) {
    for (int k = 0; k < commands; ++k)
      for (int j = 0; j < commands; ++j) to[commands * k + j] = j != k ? 0.0 : actuated[k] > 0 ? -step : step;
    return;
  }
  const bool pulled = std::any_of(actuated, actuated + commands, [](const T& pull) { return value_of(pull) != 0; });
  T squares = 0;
  for (int k = 0; k < commands; ++k) squares += pulled ? actuated[k] * actuated[k] : T(1.0);
  const T length = root(squares);
  for (int k = 0; k < commands; ++k) to[k] = -step * ((pulled ? actuated[k] : T(-1.0)) / length);
}

template <int D>
template <class T>
void Estimator<D>::write_commands(const T* actuated, RowsOf<T> rows) const {
  const Actuation& actuation = settings_.actuation;
  Steps<T> by;
  steps(actuated, by);
  T at[Actuation::kMost];
  for (int companion = 0; companion <= companions_; ++companion) {
    std::copy_n(actuated, actuation.actions, at);
    for (int k = 0; companion > 0 && k < actuation.commands; ++k) at[k] += by[actuation.commands * (companion - 1) + k];
    actuation.write_command(at, rows[companion]);
  }
}

// A robot that nothing touches is the free robot: the fields of its block are those of a block without obstacles, and
// they begin alike.
template <int D>
void Estimator<D>::copy_state(const double* block, double* free) const {
  const std::size_t alike = layout_.multipliers.offset;
  std::copy_n(block, alike, free);
  std::fill_n(free + alike, free_layout_.size - alike, 0.0);
  for (const auto field : {&BlockLayout::tip_slopes, &BlockLayout::disk_multipliers, &BlockLayout::trend_coordinates}) {
    const BlockField& from = layout_.*field;
    std::copy_n(block + from.offset, from.size, free + (free_layout_.*field).offset);
  }
  free[free_layout_.clearance.offset] = HUGE_VAL;
}

template <int D>
void Estimator<D>::prepare(int robot, const double* block, const double* actuated) const {
  if (!free_.batch) return;
  const int row = free_row(robot);
  if (touches(block)) return write_commands(actuated, RowsOf<double>{free_.commands[row], free_.commands.width});
  for (int companion = 0; companion <= companions_; ++companion) copy_state(block, free_.blocks[row + companion]);
}

template <int D>
bool Estimator<D>::move(int thread, int robot, SlopeTable& slopes) const {
  for (int companion = 0; companion <= companions_; ++companion)
    if (!free_.follow(thread, free_row(robot) + companion, slopes)) return false;
  return true;
}

template <int D>
template <class T>
std::array<T, D> Estimator<D>::point(const T* free, const double* lines, int line, int at) const {
  const int apart = settings_.between + 1, node = std::min(at / apart, nodes_ - 2);
  const double fraction = static_cast<double>(at) / apart - node, *hole = lines + (D - 1) * line;
  const T *nodes = free + free_layout_.nodes.offset, *frames = free + free_layout_.frames.offset;
  std::array<T, D> out{};
  for (int end = 0; end < 2; ++end) {
    const double part = end == 0 ? 1 - fraction : fraction;
    if (part == 0) continue;
    for (int d = 0; d < D; ++d) {
      const T* place = nodes + 3 * (node + end) + d;
      if constexpr (D == 2) {
        out[d] += part * (*place + hole[0] * frames[2 * (node + end) + d]);
      } else {
        const T* axes = frames + 9 * (node + end) + 3 * d;
        out[d] += part * (*place + hole[0] * axes[0] + hole[1] * axes[1]);
      }
    }
  }
  return out;
}

template <int D>
template <class T>
T Estimator<D>::slope(const T* moved, const T* steps, int command) const {
  const int commands = settings_.actuation.commands;
  if (settings_.alike) return steps[command] / (settings_.step_mm * settings_.step_mm) * moved[0];
  return moved[command] / steps[commands * command + command];
}

template <int D>
template <class T>
typename Estimator<D>::template Pressing<T> Estimator<D>::pressing(int robot, const T* block, const T* steps,
                                                                   const T* free) const {
  const T *multipliers = block + layout_.multipliers.offset, *forces = block + layout_.forces.offset;
  const double* lines = arrays_.lines_mm[robot];
  const std::size_t size = free_layout_.size, points = static_cast<std::size_t>(lines_) * positions_;
  Pressing<T> out;
  for (int j = 0; j < obstacles_; ++j) {
    const T *own = multipliers + points * j, *force = forces + D * j;
    T sum = 0;
    for (std::size_t p = 0; p < points; ++p) sum += own[p];
    for (std::size_t p = 0; p < points; ++p) {
      if (value_of(own[p]) == 0) continue;
      const T share = own[p] / sum;
      const int line = static_cast<int>(p) / positions_, at = static_cast<int>(p) % positions_;
      const std::array<T, D> here = point(free, lines, line, at);
      T moved[D][Actuation::kMost];
      for (int companion = 0; companion < companions_; ++companion) {
        const std::array<T, D> there = point(free + size * (companion + 1), lines, line, at);
        for (int d = 0; d < D; ++d) moved[d][companion] = there[d] - here[d];
      }
      for (int k = 0; k < settings_.actuation.commands; ++k)
        for (int d = 0; d < D; ++d) out.works[k] -= share * force[d] * slope(moved[d], steps, k);
    }
    out.size += norm<D>(force);
  }
  return out;
}

template <int D>
template <class T>
T Estimator<D>::contact_factor(int robot, const T* tensions, const T* free, const Pressing<T>& pressing) const {
  const Actuation& actuation = settings_.actuation;
  const double ratio = *arrays_.products[robot] / *arrays_.squares[robot];
  T lacking[Actuation::kMost], inputs[3] = {0, 0, settings_.least_slope * pressing.size};
  for (int c = 0; c < actuation.cables; ++c)
    lacking[c] = tensions[c] - ratio * signed_tension(free, c, free[free_layout_.tensions.offset + c]);
  for (int k = 0; k < actuation.commands; ++k) {
    inputs[0] += pressing.works[k] * actuation.work(lacking, k);
    inputs[1] += pressing.works[k] * pressing.works[k];
  }
  return apply<3>(work_factor, inputs);
}

// The works of the force at the tip, from how far the companions have moved.
template <int D>
template <class T>
T Estimator<D>::tip_factor(const Measured<T>& measured, const T* loads, const T* steps) const {
  const Actuation& actuation = settings_.actuation;
  const T* total = measured.block + layout_.force.offset;
  T force[D], inputs[3] = {0, 0, settings_.least_slope * norm<D>(total)};
  std::copy_n(total, D, force);
  if (D == 2) {  // the normal turned by 90 degrees
    force[0] -= settings_.friction * total[1];
    force[1] += settings_.friction * total[0];
  }
  const auto tip = [&](int row) {
    return measured.free + free_layout_.size * row + free_layout_.nodes.offset + 3 * (nodes_ - 1);
  };
  for (int k = 0; k < actuation.commands; ++k) {
    T work = 0, moved[Actuation::kMost];
    for (int d = 0; d < D; ++d) {
      for (int companion = 0; companion < companions_; ++companion)
        moved[companion] = tip(companion + 1)[d] - tip(0)[d];
      work -= force[d] * slope(moved, steps, k);
    }
    inputs[0] += work * actuation.work(loads, k);
    inputs[1] += work * work;
  }
  return apply<3>(work_factor, inputs);
}

template <int D>
template <class T>
T Estimator<D>::paper_factor(const Measured<T>& measured, const T* tensions, const T* steps) const {
  T loads[Actuation::kMost];
  for (int c = 0; c < settings_.actuation.cables; ++c) loads[c] = tensions[c] - measured.onsets[c];
  if (settings_.tip == TipSlopes::kDifferences) return tip_factor(measured, loads, steps);
  constexpr int kSlopes = D == 2 ? 3 : 10, kInputs = D == 2 ? 6 : 15;
  const T* own = measured.block + layout_.tip_slopes.offset;
  const double travel = settings_.travel_mm;
  T inputs[kInputs];
  T* to = std::copy_n(measured.block + layout_.force.offset, D, inputs);
  if constexpr (D == 2)
    *to++ = travel * loads[0];
  else
    to = std::copy_n(loads, 2, to);
  for (int k = 0; k < kSlopes; ++k) {
    to[k] = settings_.tip == TipSlopes::kFitted ? T(settings_.fitted[k]) : own[k];
    if (D == 3 && k % 5 >= 3) to[k] = travel * to[k];
  }
  const auto law = [this](const double* numbers, double* slopes) {
    return virtual_work<D>(numbers, settings_.friction, slopes);
  };
  return apply<kInputs>(law, inputs);
}

template <int D>
template <class T>
Estimate<T> Estimator<D>::estimate(int robot, const Measured<T>& measured) const {
  const Actuation& actuation = settings_.actuation;
  const bool touching = touches(measured.block);
  // The model that nothing touches is the free robot.
  const T* free = touching ? measured.free : measured.block;
  const BlockLayout& layout = touching ? free_layout_ : layout_;
  Estimate<T> out;
  if (settings_.learns) {
    T needed[Actuation::kMost];
    for (int c = 0; c < actuation.cables; ++c) needed[c] = signed_tension(free, c, free[layout.tensions.offset + c]);
    for (int k = 0; k < actuation.commands; ++k) out.free_forces[k] = actuation.work(needed, k);
  }
  if (!touching) return out;
  T tensions[Actuation::kMost];
  for (int c = 0; c < actuation.cables; ++c) tensions[c] = signed_tension(measured.block, c, measured.tensions[c]);
  Steps<T> by;
  Pressing<T> pressed;
  if (free) {
    steps(measured.actuated, by);
    pressed = pressing(robot, measured.block, by, free);
  }
  out.paper = paper_factor(measured, tensions, by);
  out.chosen = settings_.by_contact ? contact_factor(robot, tensions, free, pressed) : out.paper;
  for (int k = 0; settings_.learns && k < actuation.commands; ++k)
    out.levers[k] = pressed.works[k] / (pressed.size > kTiny ? pressed.size : T(kTiny));
  return out;
}

// Learns the rigidity from a robot that nothing touches: its tensions are those of the free robot.
template <int D>
void Estimator<D>::learn(int robot, const Measured<double>& measured) const {
  double product = 0, square = 0;
  for (int c = 0; c < settings_.actuation.cables; ++c) {
    const double free = measured.block[layout_.tensions.offset + c];  // of the same sign as the measured one
    product += measured.tensions[c] * free;
    square += free * free;
  }
  const double weight = 1 / (settings_.tension_noise * settings_.tension_noise);
  *arrays_.products[robot] += weight * product;
  *arrays_.squares[robot] += weight * square;
}

template <int D>
void Estimator<D>::update(int robot, const Measured<double>& measured) const {
  if (settings_.learns && !touches(measured.block)) learn(robot, measured);
  const Estimate<double> found = estimate(robot, measured);
  *arrays_.chosen[robot] = found.chosen;
  *arrays_.paper[robot] = found.paper;
  if (!settings_.learns) return;
  std::copy_n(found.free_forces, settings_.actuation.commands, arrays_.free_forces[robot]);
  std::copy_n(found.levers, settings_.actuation.commands, arrays_.levers[robot]);
}

template <int D>
double Estimator<D>::factor(int robot, const Measured<double>& measured) const {
  return touches(measured.block) ? estimate(robot, measured).chosen : 0.0;
}

#define CCR_INSTANTIATE(D, T)                                                 \
  template Estimate<T> Estimator<D>::estimate(int, const Measured<T>&) const; \
  template void Estimator<D>::write_commands(const T*, RowsOf<T>) const;
#define CCR_INSTANTIATE_SPACE(D) \
  template class Estimator<D>;   \
  CCR_INSTANTIATE(D, double)     \
  CCR_INSTANTIATE(D, Dual<2>)    \
  CCR_INSTANTIATE(D, Dual<4>)    \
  CCR_INSTANTIATE(D, Dual<8>)
CCR_INSTANTIATE_SPACE(2)
CCR_INSTANTIATE_SPACE(3)
#undef CCR_INSTANTIATE
#undef CCR_INSTANTIATE_SPACE

}  // namespace ccr
