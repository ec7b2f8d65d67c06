// Environments of a planar rod beside a circle, with all arrays that their steps need, for the tests of transitions.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>
#include <valarray>
#include <vector>

#include "random.hpp"
#include "robots.hpp"
#include "transition/transition.hpp"

namespace ccr::testing {

// Rows of numbers, one for each environment, of which arrays take columns.
template <class T>
struct Columns {
  Columns(int count, std::size_t width) : width(width), all(T{}, count * width) {}

  RowsOf<T> take(std::size_t size) {
    used += size;
    if (used > width) throw std::length_error("the rows are too short");
    return {&all[used - size], width};
  }
  bool same(int row, const Columns& other, int its) const {
    return std::memcmp(&all[width * row], &other.all[width * its], width * sizeof(T)) == 0;
  }
  void restore(const Columns& from) { std::copy(std::begin(from.all), std::end(from.all), std::begin(all)); }

  std::size_t width, used = 0;
  std::valarray<T> all;
};

// All that steps of environments change. The arrays refer to it, so that a copy only keeps it.
struct Memory {
  Memory(int count, std::size_t free)
      : numbers(count, 3072), free(count, free), shown(count, 256), marks(count, 3), times(count, 1) {}

  // Whether an environment is, bit for bit, one of another memory.
  bool same(int row, const Memory& other, int its) const {
    return numbers.same(row, other.numbers, its) && free.same(row, other.free, its) &&
           shown.same(row, other.shown, its) && marks.same(row, other.marks, its) && times.same(row, other.times, its);
  }
  void restore(const Memory& from) {
    numbers.restore(from.numbers);
    free.restore(from.free);
    shown.restore(from.shown);
    marks.restore(from.marks);
    times.restore(from.times);
  }

  Columns<double> numbers, free;  // of the free robots the blocks
  Columns<float> shown;
  Columns<bool> marks;
  Columns<std::int64_t> times;
};

struct EnvironmentOptions {
  bool senses = true, estimated = true, differentiates = false;
  int threads = 1;
  bool resolves = true;  // whether forces are read in steps of a resolution
};

class Environments {
 public:
  static constexpr int kActions = 2, kCompanions = 1;  // of one cable, and the insertion
  static constexpr double kLength = 180, kOffset = 8, kRigidity = 5000, kLimit = 0.05;
  static constexpr double kForce = kRigidity / (kLength * kLength);

  // Environments of these numbers, each the same whatever the others are.
  Environments(std::vector<int> numbers, EnvironmentOptions options)
      : options_(options),
        numbers_(std::move(numbers)),
        robot_(make_robot<2>({.rod = true, .segments = kSegments, .rigidity = kRigidity, .max_tension = 60})),
        robots_(robot_, count(), 1, options.threads),
        model_(robot_, count(), 1, options.threads),
        free_(robot_, kEach * count(), 0, options.threads),
        memory(count(), kEach * free_.layout().size),
        free_commands_(kEach * 2 * count()),
        counts_(3 * (2 + kEach) * count()) {
    make();
    for (int k = 0; k < count(); ++k) begin(k);
  }
  Environments(const Environments&) = delete;

  int count() const { return static_cast<int>(numbers_.size()); }
  int number(int k) const { return numbers_[k]; }
  int inputs() const { return (options_.senses ? 2 : 1) * kActions; }
  const BlockLayout& layout() const { return robots_.layout(); }
  const double* free_block(int k) const { return &memory.free.all[memory.free.width * k]; }
  bool converged(int k) const { return counts_[k] == 0; }
  // The row of the last observation as it was, neither delayed nor within bounds.
  const double* row(int k) const { return sensors.history[k] + observer.source.size() * (times[k][0] % 8); }

  // Steps some environments, with a row of actions for each.
  void step(const std::vector<int>& which, const std::vector<double>& actions) {
    const Stage last = options_.differentiates ? Stage::kDerive : Stage::kObserve;
    const auto never = [] { return false; };
    const auto work = [&](int thread, int k) {
      transition_->run(thread, which[k], &actions[kActions * k], Stage::kMark, last);
    };
    robots_.share(which, work, never);
  }

 private:
  static constexpr int kSegments = 12, kNoise = 997, kEach = 1 + kCompanions;

  BatchArrays<2> arrays(Batch<2>& batch, RowsOf<double> blocks, RowsOf<double> commands, int first) {
    std::int64_t* counts = counts_.data() + 3 * first;
    return {&batch, blocks, commands, counts, counts + batch.count(), counts + 2 * batch.count()};
  }
  void make();
  void make_observer();
  void begin(int k);
  void sample(int k);

  EnvironmentOptions options_;
  std::vector<int> numbers_;
  Robot robot_;
  Batch<2> robots_, model_, free_;

 public:
  Memory memory;
  BatchArrays<2> robots, model;
  Sensors sensors;
  ObserverSettings observer;
  EpisodeArrays episodes;
  ReadingArrays readings;
  SlopeArrays slopes;
  EstimatorArrays estimates;
  RowsOf<std::int64_t> times;

 private:
  std::vector<double> free_commands_, table_;
  std::vector<std::int64_t> counts_;
  RowsOf<double> sensed_[5], set_[3], lines_;  // what a step only reads
  std::optional<Estimator<2>> estimator_;
  std::optional<Transition<2>> transition_;
};

// Columns of poses, encoders, what the estimator tells, forces and flags.
inline void Environments::make_observer() {
  const int nodes = 3 * (kSegments + 1), flags = static_cast<int>(layout().flags.size), known = nodes + 2;
  const std::size_t size = known + 10 + flags;
  observer.source.resize(size);
  observer.factor.resize(size);
  observer.low.resize(size, -1.5);
  observer.high.resize(size, 1.5);
  observer.delayed.resize(size);
  observer.encoder_factor = {1 / kOffset, 1 / kLength};
  observer.pose_factor = {1 / kLength, 1 / kLength, 1 / std::numbers::pi};
  observer.force_n = kForce;
  observer.tension_n = kRigidity / (kOffset * kLength);
  observer.lever_unit = kLength / kOffset;
  for (int j = 0; j < nodes; ++j) {
    observer.source[j] = static_cast<int>(layout().nodes.offset) + j;
    observer.factor[j] = observer.pose_factor[j % 3];
    observer.delayed[j] = 1;
  }
  observer.nodes = {0, nodes};
  observer.encoders = {{nodes, 1}, {nodes + 1, 1}};
  Entry* const entries[] = {&observer.tension, &observer.free_tension,  &observer.lever,
                            &observer.share,   &observer.desired_force, &observer.force_error};
  for (int k = 0; k < 6; ++k) *entries[k] = {known + k, 1};
  observer.force_est = {known + 6, 2};
  observer.force_measured = {known + 8, 2};
  observer.contact = {known + 10, flags};
}

inline void Environments::make() {
  make_observer();
  auto& [numbers, free, shown, marks, steps] = memory;
  const std::size_t columns = observer.source.size(), block = layout().size;
  const auto take = [&](std::size_t size) { return numbers.take(size); };
  robots = arrays(robots_, take(block), take(2), 0);
  model = options_.senses ? arrays(model_, take(block), take(2), count()) : robots;
  const std::size_t widths[] = {Sensors::kNumbers, 1, 2, 3, static_cast<std::size_t>(observer.nodes.size)};
  for (int k = 0; k < 5; ++k) sensed_[k] = take(widths[k]);
  for (int k = 0; k < 3; ++k) set_[k] = take(2);
  lines_ = take(2);
  times = steps.take(1);
  Random random(1);
  for (int k = 0; k < kNoise; ++k) table_.push_back(random.uniform(-1.7, 1.7));
  const auto read_only = [](const RowsOf<double>& rows) { return RowsOf<const double>{rows.data, rows.width}; };
  if (options_.senses)
    sensors = {.numbers = read_only(sensed_[0]),
               .tension_zero = read_only(sensed_[1]),
               .force_bias = read_only(sensed_[2]),
               .pose_noise = read_only(sensed_[3]),
               .pose_error = read_only(sensed_[4]),
               .motor = take(kActions),
               .moved_in = marks.take(1),
               .history = take(Sensors::kHistory * columns),
               .starting = marks.take(1),
               .table = table_.data(),
               .table_size = kNoise,
               .cables = 1,
               .space = 2,
               .nodes = kSegments + 1,
               .turns = 1};
  episodes = {.actuated = take(kActions),
              .actions = take(kActions),
              .time = times,
              .desired = read_only(set_[0]),
              .goal = read_only(set_[1]),
              .profile = {},
              .obstacle = read_only(set_[2]),
              .robot = read_only(set_[2]),
              .tensions = take(1),
              .onsets = take(1)};
  readings = {.force_true = take(2),
              .force_est = take(2),
              .force_paper = take(2),
              .regulated = take(2),
              .goal = take(1),
              .force = take(1),
              .desired = take(1),
              .error = take(1),
              .cost = take(1),
              .terms = take(kTerms),
              .reward = take(1),
              .actuators = take(3),
              .observation = shown.take(columns)};
  if (options_.differentiates)
    slopes = {.observation = take(inputs() * columns),
              .force_true = take(inputs() * 2),
              .force_est = take(inputs() * 2),
              .regulated = take(inputs() * 2),
              .reward = take(inputs()),
              .present = shown.take(columns),
              .motor_per_action = take(kActions),
              .motor_per_motor = take(kActions),
              .follows = take(kActions),
              .effort = take(kActions),
              .found = marks.take(1)};
  estimates = {take(1), take(1), take(1), take(1), take(1), take(1), read_only(lines_)};
  const Actuation actuation{.cables = 1,
                            .commands = 1,
                            .actions = kActions,
                            .matrix = {1},
                            .recovery = {},
                            .low = {0, 0.8 * kLength},
                            .high = {14, kLength},
                            .increment = {1, 2}};
  const EstimatorSettings settings{.actuation = actuation,
                                   .learns = options_.senses,
                                   .by_contact = true,
                                   .alike = false,
                                   .pairs = false,
                                   .tip = TipSlopes::kDifferences,
                                   .fitted = {},
                                   .friction = 0.1,
                                   .travel_mm = kOffset,
                                   .step_mm = 0.05,
                                   .least_slope = 1,
                                   .tension_noise = 0.3,
                                   .between = 0};
  const TaskSettings task{.target = -1,
                          .vector = false,
                          .estimated = options_.estimated,
                          .profile_steps = 0,
                          .force_limit = kLimit,
                          .length_mm = kLength,
                          .weights = {1, 1, 0.5, 0.2, 0.01}};
  const std::size_t one = free_.layout().size;
  estimator_.emplace(settings, layout(), count(),
                     arrays(free_, {&free.all[0], one}, {free_commands_.data(), 2}, 2 * count()), estimates);
  transition_.emplace(robots, model, actuation, sensors, *estimator_, observer, task, episodes, readings, slopes);
  for (Batch<2>* batch : {&model_, &free_}) batch->set_leader(&robots_);
}

// Samples the robot, its obstacle and its sensors.
inline void Environments::sample(int k) {
  Random random(static_cast<std::uint64_t>(numbers_[k]));
  const Obstacle<2> obstacle =
      circle(robot_, 44 + random.uniform(-1, 1), 104 + random.uniform(-5, 5), 15, numbers_[k] % 4 == 3 ? 0.05 : 0);
  for (Batch<2>* batch : {&robots_, &model_}) batch->set_obstacles(k, {obstacle});
  if (numbers_[k] % 3 == 1) {
    Robot other = robot_;
    other.rigidity *= 1.25;
    for (Batch<2>* batch : {&robots_, &model_}) batch->set_robot(k, &other);
    for (int each = 0; each < kEach; ++each) free_.set_robot(kEach * k + each, &other);
  }
  set_[0][k][0] = kForce * random.uniform(0.5, 2);
  std::copy_n(std::array{0.0, kOffset}.data(), 2, lines_[k]);
  const double ranges[Sensors::kNumbers][2] = {{0, 7.99}, {0.1, 0.6}, {0, 0.2},  {0.8, 1.2},
                                               {0, 0.01}, {0, 0.01},  {0, 0.01}, {0, kNoise - 1e-9}};
  for (int j = 0; j < Sensors::kNumbers; ++j) sensed_[0][k][j] = random.uniform(ranges[j][0], ranges[j][1]);
  for (const Sensors::Number whole : {Sensors::kLatency, Sensors::kStart})
    sensed_[0][k][whole] = std::floor(sensed_[0][k][whole]);
  if (!options_.resolves) sensed_[0][k][Sensors::kResolution] = 0;
  for (int j = 1; j < 5; ++j)
    for (int i = 0; i < (j < 4 ? j : observer.nodes.size); ++i) sensed_[j][k][i] = random.uniform(0, 0.01);
}

// Begins the episode of an environment, its robot at rest.
inline void Environments::begin(int k) {
  sample(k);
  robots_.at(0, k).rest(kLength, robots.blocks[k]);
  std::copy_n(robots.blocks[k], layout().size, model.blocks[k]);
  for (int each = 0; each < kEach; ++each)
    free_.at(0, kEach * k + each).rest(kLength, &memory.free.all[free_.layout().size * (kEach * k + each)]);
  episodes.actuated[k][1] = kLength;
  if (options_.senses) {
    sensors.motor[k][1] = kLength;
    sensors.starting[k][0] = true;
  }
  *estimates.products[k] = *estimates.squares[k] = 1;
  transition_->run(0, k, nullptr, Stage::kSense, Stage::kObserve);
}

}  // namespace ccr::testing
