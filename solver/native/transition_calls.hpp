// The calls of the module solver._kernel on a transition: environments side by side, with their state in arrays of
// Python.
#pragma once

#include <nanobind/nanobind.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "batch_calls.hpp"
#include "kernel_input.hpp"
#include "transition/transition.hpp"

namespace ccr::binding {

using ArrayDict = nb::typed<nb::dict, nb::str, nb::any>;  // arrays of Python by their names
using Indices = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

inline std::vector<double> to_vector(const Values& values) { return {values.data(), values.data() + values.size()}; }

inline Actuation make_actuation(const Table& matrix, const std::optional<Table>& recovery, const Values& low,
                                const Values& high, const Values& increment) {
  const std::size_t cables = matrix.shape(0), commands = matrix.shape(1), actions = increment.size();
  require(low.size() == actions && high.size() == actions && (actions == commands || actions == commands + 1),
          "low, high and increment must have a number for each command, and one more where the base is inserted");
  require(cables >= 1 && commands >= 1 && cables < Actuation::kMost && commands < Actuation::kMost,
          "matrix must have a row for each cable and a column for each command, few of both");
  require(!recovery || (recovery->shape(0) == commands && recovery->shape(1) == cables),
          "recovery must be (commands, cables)");
  const auto numbers = [](const Table& table) {
    return std::vector<double>(table.data(), table.data() + table.size());
  };
  return {.cables = static_cast<int>(cables),
          .commands = static_cast<int>(commands),
          .actions = static_cast<int>(actions),
          .matrix = numbers(matrix),
          .recovery = recovery ? numbers(*recovery) : std::vector<double>{},
          .low = to_vector(low),
          .high = to_vector(high),
          .increment = to_vector(increment)};
}

// Arrays by their names, each with a row for each of some robots.
class NamedArrays {
 public:
  NamedArrays(ArrayDict arrays, std::size_t count) : arrays_(std::move(arrays)), count_(count) {}

  template <class T>
  RowsOf<T> rows(const char* name, std::size_t width) const {
    using Element = std::remove_const_t<T>;
    require(arrays_.contains(name), std::string(name) + " is missing");
    const auto array = nb::cast<nb::ndarray<Element, nb::c_contig, nb::device::cpu>>(arrays_[name], false);
    require(array.size() == count_ * width, std::string(name) + " must have " + std::to_string(width) +
                                                " numbers for each of " + std::to_string(count_) + " robots");
    return {array.data(), width};
  }
  // The same of any width from a least one on.
  template <class T>
  RowsOf<T> rows_from(const char* name, std::size_t least) const {
    require(arrays_.contains(name), std::string(name) + " is missing");
    const auto array =
        nb::cast<nb::ndarray<std::remove_const_t<T>, nb::c_contig, nb::device::cpu>>(arrays_[name], false);
    require(array.size() % count_ == 0 && array.size() / count_ >= least,
            std::string(name) + " must have at least " + std::to_string(least) + " numbers for each robot");
    return {array.data(), array.size() / count_};
  }
  template <class T>
  RowsOf<T> rows_if(const char* name, std::size_t width) const {
    return arrays_.contains(name) ? rows<T>(name, width) : RowsOf<T>{};
  }

 private:
  ArrayDict arrays_;
  std::size_t count_;
};

template <int D>
BatchArrays<D> make_batch_arrays(Batch<D>& batch, const ArrayDict& arrays) {
  const NamedArrays named(arrays, batch.count());
  return {.batch = &batch,
          .blocks = named.rows<double>("blocks", batch.layout().size),
          .commands = named.rows<double>("commands", batch.layout().cables.size + 1),
          .statuses = named.rows<std::int64_t>("statuses", 1).data,
          .iterations = named.rows<std::int64_t>("iterations", 1).data,
          .factorizations = named.rows<std::int64_t>("factorizations", 1).data};
}

template <int D>
Estimator<D> make_estimator(const EstimatorSettings& settings, const BatchArrays<D>& model, const BatchArrays<D>* free,
                            const ArrayDict& arrays) {
  const NamedArrays named(arrays, model.batch->count());
  const std::size_t commands = settings.actuation.commands, lines = model.layout().multipliers.shape[1];
  require((settings.tip != TipSlopes::kDifferences && !settings.by_contact && !settings.learns) || free,
          "free robots are missing");
  return Estimator<D>(settings, model.layout(), model.batch->count(), free ? *free : BatchArrays<D>{},
                      {.chosen = named.rows<double>("chosen", 1),
                       .paper = named.rows<double>("paper", 1),
                       .free_forces = named.rows<double>("free_forces", commands),
                       .levers = named.rows<double>("levers", commands),
                       .products = named.rows<double>("products", 1),
                       .squares = named.rows<double>("squares", 1),
                       .lines_mm = named.rows<const double>("lines_mm", lines * (D - 1))});
}

// The sensors of robots whose bodies a layout describes, and of which observations have so many columns.
template <int D>
Sensors make_sensors(const ArrayDict& arrays, const Values& table, const BatchArrays<D>& robots, std::size_t columns,
                     int actions) {
  const NamedArrays named(arrays, robots.batch->count());
  const int cables = static_cast<int>(robots.layout().cables.size), nodes = robots.layout().nodes.shape[0];
  const std::size_t turns = D == 2 ? 1 : 3, pose = D + turns;
  return {.numbers = named.rows<const double>("numbers", Sensors::kNumbers),
          .tension_zero = named.rows<const double>("tension_zero", cables),
          .force_bias = named.rows<const double>("force_bias", D),
          .pose_noise = named.rows<const double>("pose_noise", pose),
          .pose_error = named.rows<const double>("pose_error", pose * nodes),
          .motor = named.rows<double>("motor_mm", actions),
          .moved_in = named.rows<bool>("moved_in", cables),
          .history = named.rows<double>("history", Sensors::kHistory * columns),
          .starting = named.rows<bool>("history_empty", 1),
          .table = table.data(),
          .table_size = static_cast<std::int64_t>(table.size()),
          .cables = cables,
          .space = D,
          .nodes = nodes,
          .turns = static_cast<int>(turns)};
}

template <int D>
EpisodeArrays make_episodes(const ArrayDict& arrays, std::size_t count, const Actuation& actuation,
                            const ObserverSettings& observer, int profile_steps) {
  const NamedArrays named(arrays, count);
  return {.actuated = named.rows<double>("actuated_mm", actuation.actions),
          .actions = named.rows<double>("last_actions", actuation.actions),
          .time = named.rows<std::int64_t>("time", 1),
          .desired = named.rows<const double>("desired_n", 1),
          .goal = named.rows<const double>("goal_n", D),
          .profile = named.rows_if<const double>("profiles", profile_steps),
          .obstacle = named.rows_from<const double>("obstacle_features", observer.obstacle.size),
          .robot = named.rows_from<const double>("robot_features", observer.robot.size),
          .tensions = named.rows<double>("tensions", actuation.cables),
          .onsets = named.rows<double>("onsets", actuation.cables)};
}

template <int D>
ReadingArrays make_readings(const ArrayDict& arrays, std::size_t count, const Actuation& actuation, std::size_t goal,
                            std::size_t columns) {
  const NamedArrays named(arrays, count);
  const std::size_t actuators = 2 * actuation.cables + actuation.inserts();
  const RowsOf<double> forces = named.rows<double>("forces", 4 * D),
                       numbers = named.rows<double>("numbers", 5 + kTerms + actuators);
  const auto column = [](const RowsOf<double>& rows, std::size_t at) {
    return RowsOf<double>{rows.data + at, rows.width};
  };
  return {.force_true = forces,
          .force_est = column(forces, D),
          .force_paper = column(forces, 2 * D),
          .regulated = column(forces, 3 * D),
          .goal = named.rows<double>("goal", goal),
          .force = numbers,
          .desired = column(numbers, 1),
          .error = column(numbers, 2),
          .cost = column(numbers, 4),
          .terms = column(numbers, 5),
          .reward = column(numbers, 3),
          .actuators = column(numbers, 5 + kTerms),
          .observation = named.rows<float>("observation", columns)};
}

// Slopes of what is read in the inputs of a step, of which there are so many.
template <int D>
SlopeArrays make_slopes(const ArrayDict& arrays, std::size_t count, std::size_t inputs, std::size_t actions,
                        std::size_t columns) {
  const NamedArrays named(arrays, count);
  return {.observation = named.rows<double>("observation", inputs * columns),
          .force_true = named.rows<double>("force_true", inputs * D),
          .force_est = named.rows<double>("force_est", inputs * D),
          .regulated = named.rows<double>("regulated", inputs * D),
          .reward = named.rows<double>("reward", inputs),
          .present = named.rows<float>("present", columns),
          .motor_per_action = named.rows<double>("motor_per_action", actions),
          .motor_per_motor = named.rows<double>("motor_per_motor", actions),
          .follows = named.rows<double>("follows", actions),
          .effort = named.rows<double>("effort", actions),
          .found = named.rows<bool>("found", 1)};
}

// Writes what load cells at the motors read of nominal tensions in some robots at a step of their episodes.
template <int D>
void measure_tensions(const Transition<D>& transition, const Indices& robots, const Table& nominal, const Blocks& to) {
  const Sensors& sensors = transition.sensors();
  const std::size_t cables = transition.actuation().cables;
  require(static_cast<bool>(sensors), "sensing is ideal");
  require(nominal.shape(0) == robots.size() && nominal.shape(1) == cables && to.shape(0) == robots.size() &&
              to.shape(1) == cables,
          "tensions must have a row for each robot");
  for (std::size_t k = 0; k < robots.size(); ++k) {
    const int robot = static_cast<int>(robots.data()[k]);
    require_index(transition.batch(), robot);
    for (std::size_t c = 0; c < cables; ++c)
      to.data()[cables * k + c] =
          sensors.tension(robot, transition.time(robot), static_cast<int>(c), nominal.data()[cables * k + c]);
  }
}

// Refuses settings of an observer whose columns are not those of a block or of a row.
inline void require_columns(const ObserverSettings& settings, std::size_t block) {
  const std::size_t size = settings.source.size();
  require(settings.factor.size() == size && settings.low.size() == size && settings.high.size() == size &&
              settings.delayed.size() == size,
          "source, factor, low, high and delayed must have an entry for each column");
  for (const int column : settings.source)
    require(column >= 0 && static_cast<std::size_t>(column) < block, "source must name columns of a block");
}

// Holds what a call must have to itself: all batches, of which the robots' says when to end.
template <int D>
class Session {
 public:
  using Lock = typename Batch<D>::Lock;
  Session(Batch<D>& robots, Batch<D>* model, Batch<D>* free)
      : robots_(robots), model_(model == &robots ? nullptr : model), free_(free) {
    if (model_) own_model_.emplace(*model_);
    if (free_) own_free_.emplace(*free_);
    lead(&robots);
  }
  Session(const Session&) = delete;
  ~Session() { lead(nullptr); }

 private:
  void lead(Batch<D>* leader) {
    if (model_) model_->set_leader(leader);
    if (free_) free_->set_leader(leader);
  }

  Lock robots_;
  Batch<D>*model_, *free_;
  std::optional<Lock> own_model_, own_free_;
};

// Goes through stages of a step of some robots, with a row of actions for each.
template <int D>
void run(Transition<D>& transition, const Indices& robots, const Table& actions, Stage first, Stage last) {
  const std::vector<int> indices(robots.data(), robots.data() + robots.size());
  const std::size_t width = transition.actuation().actions;
  const bool commands = first <= Stage::kCommand && last >= Stage::kCommand;
  require(!commands || (actions.shape(0) == indices.size() && actions.shape(1) == width),
          "actions must have a row for each robot, of " + std::to_string(width) + " numbers");
  const Session<D> session(transition.batch(), &transition.model(), transition.free());
  for (const int robot : indices) {
    require_index(transition.batch(), robot);
    require_sound(transition.batch().layout(), transition.block(robot));
  }
  const double* action = actions.data();
  Interruption interruption;
  {
    nb::gil_scoped_release released;
    transition.batch().share(
        indices, [&](int thread, int k) { transition.run(thread, indices[k], action + width * k, first, last); },
        interruption);
  }
  if (interruption.raised()) throw nb::python_error();
}

// Rows of what is measured of some robots.
struct MeasuredRows {
  Table blocks, actuated, tensions, onsets;
  Measured<double> at(std::size_t k) const {
    const auto row = [k](const Table& table) { return table.data() + table.shape(1) * k; };
    return {row(blocks), row(actuated), row(tensions), row(onsets), nullptr};
  }
};

// Refuses rows that are not of these robots.
template <int D>
void require_measured(const Estimator<D>& estimator, const Indices& robots, const MeasuredRows& rows) {
  const Actuation& actuation = estimator.actuation();
  const auto fits = [&](const Table& table, std::size_t width) {
    return table.shape(0) == robots.size() && table.shape(1) == width;
  };
  require(fits(rows.blocks, estimator.layout().size) && fits(rows.actuated, actuation.actions) &&
              fits(rows.tensions, actuation.cables) && fits(rows.onsets, actuation.cables),
          "blocks, actuated, tensions and onsets must have a row for each robot");
  for (std::size_t k = 0; k < robots.size(); ++k)
    require(robots.data()[k] >= 0 && robots.data()[k] < estimator.count(), "a robot index is out of range");
}

// Writes the commands of all free robots at actuated coordinates of their robots; lengths stay unless they are
// actuated.
template <int D>
void write_free_commands(const Estimator<D>& estimator, const Table& actuated, const Blocks& commands) {
  const std::size_t each = estimator.companions() + 1, width = estimator.actuation().cables + 1;
  require(actuated.shape(1) == static_cast<std::size_t>(estimator.actuation().actions) &&
              commands.shape(0) == each * actuated.shape(0) && commands.shape(1) == width,
          "commands must have a row for each free robot");
  for (std::size_t k = 0; k < actuated.shape(0); ++k)
    estimator.write_commands(actuated.data() + actuated.shape(1) * k,
                             RowsOf<double>{commands.data() + width * each * k, width});
}

// Commands the free robots of some robots to what their encoders read, or puts them where robots are that nothing
// touches.
template <int D>
void prepare_free(const Estimator<D>& estimator, const Indices& robots, const Table& blocks, const Table& actuated) {
  for (std::size_t k = 0; k < robots.size(); ++k)
    estimator.prepare(static_cast<int>(robots.data()[k]), blocks.data() + blocks.shape(1) * k,
                      actuated.data() + actuated.shape(1) * k);
}

template <int D>
void update_estimates(const Estimator<D>& estimator, const Indices& robots, const MeasuredRows& rows) {
  require_measured(estimator, robots, rows);
  for (std::size_t k = 0; k < robots.size(); ++k) {
    const int robot = static_cast<int>(robots.data()[k]);
    Measured<double> measured = rows.at(k);
    measured.free = estimator.free_block(robot);
    estimator.update(robot, measured);
  }
}

// Writes the factors that would be observed; `free` holds the blocks of all free robots.
template <int D>
void write_factors(const Estimator<D>& estimator, const Indices& robots, const MeasuredRows& rows,
                   const std::optional<Table>& free, const Output& to) {
  require_measured(estimator, robots, rows);
  require(to.size() == robots.size(), "to must have a number for each robot");
  require(free || !estimator.free().batch, "free must hold the blocks of all free robots");
  for (std::size_t k = 0; k < robots.size(); ++k) {
    const int robot = static_cast<int>(robots.data()[k]);
    Measured<double> measured = rows.at(k);
    if (free) measured.free = free->data() + free->shape(1) * estimator.free_row(robot);
    to.data()[k] = estimator.factor(robot, measured);
  }
}

}  // namespace ccr::binding
