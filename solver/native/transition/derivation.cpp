// The slopes of a step: it is gone through once more in duals.
#include <algorithm>
#include <vector>

#include "transition/reading.inc"

namespace ccr {

namespace {

constexpr double kTipStep = 1e-6;  // of a command, for slopes of those of the free tip [L]

}  // namespace

template <int D>
void Transition<D>::derive(int thread, int robot, bool of_step) {
  const auto find = [&](const BatchArrays<D>& arrays, int row, SlopeTable& slopes) {
    of_step ? arrays.differentiate_step(thread, row, slopes) : arrays.differentiate(thread, row, slopes);
  };
  find(robots_, robot, robot_slopes_);
  if (senses()) find(model_, robot, model_slopes_);
  if (estimator_.moves_free(model_.blocks[robot]))
    for (int k = 0; k <= estimator_.companions(); ++k)
      find(estimator_.free(), estimator_.free_row(robot) + k, free_slopes_);
  const int count = inputs();
  if (count <= 2) return derive<2>(thread, robot, 0);
  if (count <= 4) return derive<4>(thread, robot, 0);
  for (int first = 0; first < count; first += 8) derive<8>(thread, robot, first);
}

// Slopes of those of the free tip in the model's block, by differences of their closed form.
template <int D>
template <int P>
void Transition<D>::lift_tip_slopes(int thread, int robot, const Dual<P>* command, Dual<P>* block) const {
  const std::size_t size = layout_.tip_slopes.size, commands = actuation_.cables + actuation_.inserts();
  Continuation<D>& model = model_.batch->at(thread, robot);
  const double step = kTipStep * task_.length_mm;
  std::vector<double> at(actuation_.cables + 1), ends(2 * size);
  for (std::size_t row = 0; row < commands; ++row) {
    for (int end = 0; end < 2; ++end) {
      std::copy_n(model_.commands[robot], at.size(), at.begin());
      at[row] += end == 0 ? step : -step;
      model.tip_slopes(at.data(), ends.data() + size * end);
    }
    for (std::size_t k = 0; k < size; ++k)
      block[layout_.tip_slopes.offset + k].add((ends[k] - ends[size + k]) / (2 * step), command[row]);
  }
}

// Goes through the step once more with duals from the commands on, with slopes in P inputs from a first one on.
template <int D>
template <int P>
void Transition<D>::derive(int thread, int robot, int first) {
  using T = Dual<P>;
  constexpr int kMost = Actuation::kMost;
  const int actions = actuation_.actions;
  T actuated[kMost], motor[kMost], command[kMost], tensions[kMost];
  // Without backlash encoders tell where the robot is.
  const bool moves = senses() || robot_slopes_.kind(robot) == SlopeTable::Kind::kFound;
  const auto input = [first](double value, int at, double slope) {
    T out(value);
    if (at >= first && at < first + P) out.slopes[at - first] = slope;
    return out;
  };
  for (int k = 0; k < actions; ++k) {
    actuated[k] = input(commanded_[actions * robot + k], k, 1);
    motor[k] = input(encoders(robot)[k], senses() ? actions + k : k, moves ? 1 : 0);
  }
  std::vector<T> block(layout_.size), known, free, row(observer_.size());
  actuation_.write_command(actuated, command);
  lift<D>(layout_, robots_.blocks[robot], robot_slopes_, robot, command, block.data());
  if (senses()) {
    known.resize(layout_.size);
    actuation_.write_command(motor, command);
    lift<D>(layout_, model_.blocks[robot], model_slopes_, robot, command, known.data());
  }
  T* model = senses() ? known.data() : block.data();
  if (estimator_.takes_tip_slopes() && estimator_.touches(model_.blocks[robot]))
    lift_tip_slopes(thread, robot, command, model);
  if (estimator_.moves_free(model_.blocks[robot])) {
    const int free_row = estimator_.free_row(robot), count = estimator_.companions() + 1;
    const std::size_t size = estimator_.free_layout().size, width = actuation_.cables + 1;
    std::vector<T> commands(width * count);
    estimator_.write_commands(motor, RowsOf<T>{commands.data(), width});
    free.resize(size * count);
    for (int k = 0; k < count; ++k)
      lift<D>(estimator_.free_layout(), estimator_.free().blocks[free_row + k], free_slopes_, free_row + k,
              commands.data() + width * k, free.data() + size * k);
  }
  for (int c = 0; c < actuation_.cables; ++c) {
    const T& nominal = block[layout_.tensions.offset + c];
    tensions[c] = senses() ? sensors_.tension(robot, time(robot), c, nominal) : nominal;
  }
  const Estimate<T> found = estimator_.estimate(
      robot, Measured<T>{model, motor, tensions, episodes_.onsets[robot], free.empty() ? nullptr : free.data()});
  const Reading<T, D> reading =
      read(robot, static_cast<const T*>(block.data()), static_cast<const T*>(model), found.chosen, found.paper);
  double ahead[kMostAhead];
  write_ahead(robot, ahead);
  observer_.write(robot, static_cast<const T*>(block.data()),
                  shown(robot, static_cast<const T*>(model), reading, static_cast<const T*>(motor),
                        static_cast<const T*>(tensions), found.free_forces, found.levers, ahead),
                  row.data());
  write_slopes(robot, first, reading, block[layout_.clearance.offset], row);
}

template <int D>
template <int P>
void Transition<D>::write_slopes(int robot, int first, const Reading<Dual<P>, D>& reading, const Dual<P>& clearance,
                                 const std::vector<Dual<P>>& row) {
  const double inputs[kRewardInputs] = {reading.force.value, reading.desired, reading.error.value,
                                        clearance.value / task_.length_mm, effort(robot)};
  double slopes[kTerms * kRewardInputs], sums[kRewardInputs] = {};
  reward_slopes(task_.weights.data(), inputs, slopes);
  for (int k = 0; k < kTerms * kRewardInputs; ++k) sums[k / kTerms] += slopes[k];
  const ObserverSettings& columns = observer_.settings();
  for (int p = 0; p < std::min(P, this->inputs() - first); ++p) {
    const int at = first + p;
    double* to = slopes_.observation[robot] + observer_.size() * at;
    for (std::size_t j = 0; j < row.size(); ++j)
      to[j] = row[j].value >= columns.low[j] && row[j].value <= columns.high[j] ? row[j].slopes[p] : 0.0;
    for (int d = 0; d < D; ++d) {
      slopes_.force_true[robot][D * at + d] = reading.force_true[d].slopes[p];
      slopes_.force_est[robot][D * at + d] = reading.force_est[d].slopes[p];
      slopes_.regulated[robot][D * at + d] = reading.regulated[d].slopes[p];
    }
    slopes_.reward[robot][at] = sums[0] * reading.force.slopes[p] + sums[2] * reading.error.slopes[p] +
                                sums[3] / task_.length_mm * clearance.slopes[p];
  }
  for (int k = 0; first == 0 && k < actuation_.actions; ++k) slopes_.effort[robot][k] *= sums[4];
  const auto known = [robot](SlopeTable& table) { return table.kind(robot) == SlopeTable::Kind::kFound; };
  slopes_.found[robot][0] = known(robot_slopes_) && (!senses() || known(model_slopes_));
}

template void Transition<2>::derive(int, int, bool);
template void Transition<3>::derive(int, int, bool);

}  // namespace ccr
