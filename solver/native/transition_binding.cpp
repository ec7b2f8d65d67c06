// The classes of a transition in the Python module solver._kernel.
#include "transition_binding.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unordered_map.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "reset_calls.hpp"
#include "transition_calls.hpp"

using namespace nanobind::literals;

namespace ccr::binding {

namespace {

using Columns = std::pair<int, int>;  // the first one, and how many

Entry to_entry(const Columns& columns, std::size_t size) {
  require(columns.first >= 0 && columns.second >= 0 && static_cast<std::size_t>(columns.first + columns.second) <= size,
          "an entry must name columns of a row");
  return {columns.first, columns.second};
}

ObserverSettings make_observer(const std::vector<int>& source, const Values& factor, const Values& low,
                               const Values& high, const Mask& delayed,
                               const std::unordered_map<std::string, Columns>& entries,
                               const std::vector<Columns>& encoders, const Values& encoder_factor,
                               const Values& pose_factor, const std::vector<int>& ahead, double force_n,
                               double tension_n, double lever_unit) {
  ObserverSettings out{.source = source,
                       .factor = to_vector(factor),
                       .low = to_vector(low),
                       .high = to_vector(high),
                       .delayed = {delayed.data(), delayed.data() + delayed.size()},
                       .encoder_factor = to_vector(encoder_factor),
                       .pose_factor = to_vector(pose_factor),
                       .ahead = ahead,
                       .force_n = force_n,
                       .tension_n = tension_n,
                       .lever_unit = lever_unit};
  const std::pair<const char*, Entry*> named[] = {{"desired_force", &out.desired_force},
                                                  {"force_error", &out.force_error},
                                                  {"force_est", &out.force_est},
                                                  {"force_measured", &out.force_measured},
                                                  {"desired_ahead", &out.desired_ahead},
                                                  {"obstacle", &out.obstacle},
                                                  {"robot", &out.robot},
                                                  {"contact", &out.contact},
                                                  {"tension", &out.tension},
                                                  {"free_tension", &out.free_tension},
                                                  {"lever", &out.lever},
                                                  {"share", &out.share},
                                                  {"nodes", &out.nodes},
                                                  {"frames", &out.frames}};
  for (const auto& [name, entry] : named)
    if (const auto found = entries.find(name); found != entries.end()) *entry = to_entry(found->second, source.size());
  for (const Columns& columns : encoders) out.encoders.push_back(to_entry(columns, source.size()));
  require(ahead.size() <= kMostAhead, "ahead names too many steps");
  return out;
}

void bind_settings(nb::module_& m) {
  nb::class_<Actuation>(m, "Actuation", "The map from actions to cables and back.")
      .def(
          "__init__",
          [](Actuation* self, const Table& matrix, const std::optional<Table>& recovery, const Values& low,
             const Values& high,
             const Values& increment) { new (self) Actuation(make_actuation(matrix, recovery, low, high, increment)); },
          nb::kw_only(), "matrix"_a, "recovery"_a.none(), "low"_a, "high"_a, "increment"_a);
  nb::enum_<TipSlopes>(m, "TipSlopes", "Where the slopes of the free tip are from.")
      .value("FITTED", TipSlopes::kFitted)
      .value("BLOCK", TipSlopes::kBlock)
      .value("DIFFERENCES", TipSlopes::kDifferences);
  nb::class_<EstimatorSettings>(m, "EstimatorSettings", "What an estimator of forces is made for.")
      .def(
          "__init__",
          [](EstimatorSettings* self, const Actuation& actuation, bool learns, bool by_contact, bool alike, bool pairs,
             TipSlopes tip, const std::vector<double>& fitted, double friction, double travel_mm, double step_mm,
             double least_slope, double tension_noise, int between) {
            require(tip != TipSlopes::kFitted || fitted.size() == 3, "fitted must be three slopes");
            new (self) EstimatorSettings{actuation, learns,    by_contact, alike,       pairs,         tip,    fitted,
                                         friction,  travel_mm, step_mm,    least_slope, tension_noise, between};
          },
          nb::kw_only(), "actuation"_a, "learns"_a, "by_contact"_a, "alike"_a, "pairs"_a, "tip"_a, "fitted"_a,
          "friction"_a, "travel_mm"_a, "step_mm"_a, "least_slope"_a, "tension_noise"_a, "between"_a);
  nb::class_<ObserverSettings>(m, "ObserverSettings", "Columns of an observation.")
      .def(
          "__init__",
          [](ObserverSettings* self, const std::vector<int>& source, const Values& factor, const Values& low,
             const Values& high, const Mask& delayed, const std::unordered_map<std::string, Columns>& entries,
             const std::vector<Columns>& encoders, const Values& encoder_factor, const Values& pose_factor,
             const std::vector<int>& ahead, double force_n, double tension_n, double lever_unit) {
            new (self)
                ObserverSettings(make_observer(source, factor, low, high, delayed, entries, encoders, encoder_factor,
                                               pose_factor, ahead, force_n, tension_n, lever_unit));
          },
          nb::kw_only(), "source"_a, "factor"_a, "low"_a, "high"_a, "delayed"_a, "entries"_a, "encoders"_a,
          "encoder_factor"_a, "pose_factor"_a, "ahead"_a, "force_n"_a, "tension_n"_a, "lever_unit"_a);
  nb::class_<TaskSettings>(m, "TaskSettings", "What the force of an episode is measured against.")
      .def(
          "__init__",
          [](TaskSettings* self, int target, bool vector, bool estimated, int profile_steps, double force_limit,
             double length_mm, const std::vector<double>& weights) {
            require(weights.size() == kTerms, "weights must have a number for each term");
            new (self) TaskSettings{target, vector, estimated, profile_steps, force_limit, length_mm, weights};
          },
          nb::kw_only(), "target"_a, "vector"_a, "estimated"_a, "profile_steps"_a, "force_limit"_a, "length_mm"_a,
          "weights"_a);
  nb::enum_<Stage>(m, "Stage", "Stages of a step, in order.", nb::is_arithmetic())
      .value("MARK", Stage::kMark)
      .value("COMMAND", Stage::kCommand)
      .value("MOVE", Stage::kMove)
      .value("REACH", Stage::kReach)
      .value("MOVE_MODEL", Stage::kMoveModel)
      .value("SENSE", Stage::kSense)
      .value("MOVE_FREE", Stage::kMoveFree)
      .value("ESTIMATE", Stage::kEstimate)
      .value("READ", Stage::kRead)
      .value("REWARD", Stage::kReward)
      .value("OBSERVE", Stage::kObserve)
      .value("DERIVE", Stage::kDerive)
      .value("DERIVE_HERE", Stage::kDeriveHere);
}

template <int D>
void bind_estimator(nb::module_& m, const char* name) {
  nb::class_<Estimator<D>>(m, name, "Estimator of the contact forces of many robots.")
      .def(
          "__init__",
          [](Estimator<D>* self, const EstimatorSettings& settings, const BatchArrays<D>& model,
             const BatchArrays<D>* free,
             const ArrayDict& arrays) { new (self) Estimator<D>(make_estimator<D>(settings, model, free, arrays)); },
          nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(), nb::kw_only(), "settings"_a,
          "model"_a, "free"_a.none(), "arrays"_a)
      .def("write_free_commands", &write_free_commands<D>, "actuated"_a, "commands"_a,
           "Write the commands of all free robots at actuated coordinates of their robots.")
      .def("prepare", &prepare_free<D>, "robots"_a, "blocks"_a, "actuated"_a,
           "Command the free robots of robots that touch something; put the others where their robots are.")
      .def(
          "update",
          [](const Estimator<D>& estimator, const Indices& robots, const Table& blocks, const Table& actuated,
             const Table& tensions,
             const Table& onsets) { update_estimates<D>(estimator, robots, {blocks, actuated, tensions, onsets}); },
          "robots"_a, "blocks"_a, "actuated"_a, "tensions"_a, "onsets"_a, "Estimate the forces of some robots anew.")
      .def("pulls_reach_forces", &pulls_reach_estimates<D>, "arrays"_a, "robots"_a, "forces"_a, "obstacle"_a,
           "directions"_a, "increment"_a, "limit"_a, "reached"_a,
           "Return whether steady pulls of some robots from rest bring their estimated forces to sizes without an "
           "event.")
      .def(
          "factors",
          [](const Estimator<D>& estimator, const Indices& robots, const Table& blocks, const Table& actuated,
             const Table& tensions, const Table& onsets, const std::optional<Table>& free,
             const Output& to) { write_factors<D>(estimator, robots, {blocks, actuated, tensions, onsets}, free, to); },
          "robots"_a, "blocks"_a, "actuated"_a, "tensions"_a, "onsets"_a, "free"_a.none(), "to"_a,
          "Write the factors that would be observed with the free robots elsewhere.");
}

template <int D>
void bind_space(nb::module_& m, const TransitionNames& names) {
  nb::class_<BatchArrays<D>>(m, names.arrays, "A batch, and the arrays that its robots are moved in.")
      .def(
          "__init__",
          [](BatchArrays<D>* self, Batch<D>& batch, const ArrayDict& arrays) {
            new (self) BatchArrays<D>(make_batch_arrays<D>(batch, arrays));
          },
          nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), "batch"_a, "arrays"_a);
  bind_estimator<D>(m, names.estimator);
  nb::class_<Transition<D>>(m, names.transition, "Steps of many environments, whose state is the caller's arrays.")
      .def(
          "__init__",
          [](Transition<D>* self, const BatchArrays<D>& robots, const BatchArrays<D>& model, const Actuation& actuation,
             const std::optional<ArrayDict>& sensors, const Values& noise, const Estimator<D>& estimator,
             const ObserverSettings& observer, const TaskSettings& task, const ArrayDict& episodes,
             const ArrayDict& readings, const std::optional<ArrayDict>& slopes) {
            const std::size_t columns = observer.source.size(), count = robots.batch->count();
            require_columns(observer, robots.layout().size);
            require(task.target < robots.batch->obstacles(), "target must be an obstacle");
            const std::size_t inputs = (sensors ? 2 : 1) * actuation.actions;
            const Sensors senses =
                sensors ? make_sensors<D>(*sensors, noise, robots, columns, actuation.actions) : Sensors{};
            new (self) Transition<D>(
                robots, model, actuation, senses, estimator, observer, task,
                make_episodes<D>(episodes, count, actuation, observer, task.profile_steps),
                make_readings<D>(readings, count, actuation, task.vector ? D : 1, columns),
                slopes ? make_slopes<D>(*slopes, count, inputs, actuation.actions, columns) : SlopeArrays{});
          },
          nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>(),
          nb::keep_alive<1, 7>(), nb::keep_alive<1, 10>(), nb::keep_alive<1, 11>(), nb::keep_alive<1, 12>(),
          nb::kw_only(), "robots"_a, "model"_a, "actuation"_a, "sensors"_a.none(), "noise"_a, "estimator"_a,
          "observer"_a, "task"_a, "episodes"_a, "readings"_a, "slopes"_a.none())
      .def("measure_tensions", &measure_tensions<D>, "robots"_a, "nominal"_a, "to"_a,
           "Write what load cells at the motors read of nominal tensions in robots.")
      .def("run", &run<D>, "robots"_a, "actions"_a, "first"_a, "last"_a,
           "Go through stages of a step of some robots, with a row of actions for each.");
}

}  // namespace

void bind_transitions(nb::module_& m) {
  bind_settings(m);
  m.def("correlate", &correlate, "noise"_a, "correlation"_a, "fresh"_a,
        "Turn white noise of robots, (k, disks, numbers), into noise that is correlated from disk to disk, in place.");
  bind_space<2>(m, {"BatchArrays", "Estimator", "Transition"});
  bind_space<3>(m, {"SpatialBatchArrays", "SpatialEstimator", "SpatialTransition"});
}

}  // namespace ccr::binding
