#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <tuple>

#include "batch.hpp"
#include "tolerances.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Input = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using Output = nb::ndarray<double, nb::c_contig, nb::device::cpu>;
using Mask = nb::ndarray<const bool, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Kinds = std::vector<int>;
using Addresses = std::vector<std::uintptr_t>;
using Outlines = std::vector<Input>;

template <int D>
using Numbers = std::array<double, D>;  // a command: cables, then length

template <int D>
std::vector<ccr::Obstacle<D>> read_obstacles(const Kinds& kinds, const Input& parameters, const Input& extents,
                                             const Mask& touchable, const Input& springs, const Addresses& laws,
                                             const Outlines& outlines) {
  const std::size_t count = kinds.size(), points = touchable.shape(1);
  if (parameters.size() != ccr::kShapeSize * count || extents.size() != (D + 3) * count || touchable.shape(0) != count ||
      springs.size() != D * D * count || laws.size() != count || outlines.size() != count)
    throw std::invalid_argument("one row of parameters, extents, touchable points, springs, law and outline per obstacle");
  std::vector<ccr::Obstacle<D>> obstacles(count);
  for (std::size_t i = 0; i < count; ++i) {
    ccr::Obstacle<D>& obstacle = obstacles[i];
    const double* extent = extents.data() + (D + 3) * i;
    obstacle.shape = static_cast<ccr::Shape>(kinds[i]);
    std::copy_n(parameters.data() + ccr::kShapeSize * i, ccr::kShapeSize, obstacle.parameters.begin());
    std::copy_n(extent, D, obstacle.center.v.begin());
    obstacle.radius = extent[D];
    obstacle.min_curvature_radius = extent[D + 1];
    obstacle.inradius = extent[D + 2];
    for (std::size_t k = 0; k + D <= outlines[i].size(); k += D) {
      ccr::Position<D> point;
      std::copy_n(outlines[i].data() + k, D, point.v.begin());
      obstacle.outline.push_back(point);
    }
    std::copy_n(springs.data() + D * D * i, D * D, obstacle.spring.v.begin());
    obstacle.law = reinterpret_cast<ccr::Law>(laws[i]);
    obstacle.mounted = obstacle.spring(0, 0) > 0;
    obstacle.touchable.assign(touchable.data() + points * i, touchable.data() + points * (i + 1));
    const auto& can = obstacle.touchable;
    obstacle.everywhere = std::find(can.begin(), can.end(), 0) == can.end();
  }
  return obstacles;
}

// Refuses blocks no robot can have: what the kernel reads of them must be numbers, and the length positive.
template <int D>
void expect_sound(const double* block) {
  for (int k = 0; k < D; ++k)
    if (!std::isfinite(block[k])) throw std::invalid_argument("the block of an equilibrium has a command that is not finite");
  if (!(block[D - 1] > 0)) throw std::invalid_argument("the block of an equilibrium has a length that is not positive");
}

// Held by the thread that uses an object; another that tries meanwhile is refused.
class Turn {
 public:
  explicit Turn(std::atomic_flag& busy) : busy_(busy) {
    if (busy_.test_and_set()) throw std::runtime_error("the batch is in use by another thread; give each thread a batch of its own");
  }
  Turn(const Turn&) = delete;
  ~Turn() { busy_.clear(); }

 private:
  std::atomic_flag& busy_;
};

// Lets the interpreter handle signals now and then during a long call without its lock; true when one raised an error.
class Interruption {
 public:
  bool operator()() {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(50)) return false;
    last_ = now;
    nb::gil_scoped_acquire held;
    return raised_ = PyErr_CheckSignals() != 0;
  }
  bool raised() const { return raised_; }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  bool raised_ = false;
};

template <int D>
struct Scene {
  std::vector<ccr::Obstacle<D>> obstacles;
};

// Gaps of points (k, D) to one obstacle and their slopes: value and slope of each.
template <int D>
void measure_gaps(int kind, const Input& parameters, const Input& points, const Output& gaps) {
  if (parameters.size() > ccr::kShapeSize || points.size() % D || D * gaps.size() != (D + 1) * points.size())
    throw std::invalid_argument("points (k, d) give gaps (k, d + 1)");
  ccr::Obstacle<D> obstacle{};
  obstacle.shape = static_cast<ccr::Shape>(kind);
  std::copy_n(parameters.data(), parameters.size(), obstacle.parameters.begin());
  for (std::size_t k = 0; k < points.size() / D; ++k) {
    ccr::Position<D> point;
    std::copy_n(points.data() + D * k, D, point.v.begin());
    const ccr::Gap<D> gap = ccr::measure_gap(obstacle, point);
    double* to = gaps.data() + (D + 1) * k;
    *to = gap.value;
    std::copy_n(gap.slope.v.begin(), D, to + 1);
  }
}

// One robot in one scene.
template <int D>
class Kernel {
 public:
  Kernel(const ccr::Robot& robot, std::vector<ccr::Obstacle<D>> scene)
      : scene_(std::move(scene)), continuation_(ccr::make_continuation<D>(robot, static_cast<int>(scene_.size()))) {
    continuation_->set_obstacles(scene_);
  }

  std::size_t block_size() const { return continuation_->layout().size; }

  std::tuple<int, int, int> step(const Input& from, const Numbers<D>& command, const Output& to) {
    expect(from);
    expect(to.size());
    const ccr::StepResult result = continuation_->follow(from.data(), command.data(), to.data());
    return {static_cast<int>(result.status), result.iterations, result.factorizations};
  }

  std::tuple<std::vector<double>, int> trace(const Input& from, const Numbers<D>& command) {
    expect(from);
    std::vector<double> shapes, to(continuation_->layout().size);
    const ccr::StepResult result = continuation_->trace(from.data(), command.data(), to.data(), shapes);
    return {std::move(shapes), static_cast<int>(result.reason)};
  }

  std::array<double, 3> optimality(const Input& block) {
    expect(block);
    const ccr::Optimality found = continuation_->optimality(block.data());
    return {found.stationarity, found.gap, found.complementarity};
  }

 private:
  void expect(const Input& from) const {
    expect(from.size());
    expect_sound<D>(from.data());
  }

  void expect(std::size_t size) const {
    if (size != continuation_->layout().size) throw std::invalid_argument("block of the wrong size for this robot and scene");
  }

  std::vector<ccr::Obstacle<D>> scene_;
  std::unique_ptr<ccr::Continuation<D>> continuation_;
};

using Blocks = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Counts = nb::ndarray<std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// Robots alike in scenes of equally many obstacles; their blocks and commands are the caller's arrays.
template <int D>
class Fleet {
 public:
  Fleet(const ccr::Robot& robot, int count, int obstacles, int threads)
      : batch_(robot, count, obstacles, threads), count_(count), obstacles_(obstacles) {}

  void assign(int robot, std::vector<ccr::Obstacle<D>> scene) {
    const Turn turn(busy_);
    if (robot < 0 || robot >= count_ || static_cast<int>(scene.size()) != obstacles_)
      throw std::invalid_argument("a robot of the fleet, and as many obstacles as it was made for");
    batch_.scene(robot) = std::move(scene);
  }

  void step(const std::vector<int>& robots, const Table& commands, const Blocks& blocks, const Counts& statuses,
            const Counts& iterations, const Counts& factorizations) {
    const Turn turn(busy_);
    const std::size_t count = count_;
    if (commands.shape(0) != count || commands.shape(1) != D || blocks.shape(0) != count ||
        blocks.shape(1) != batch_.layout().size || statuses.shape(0) != count || iterations.shape(0) != count || factorizations.shape(0) != count)
      throw std::invalid_argument("one row of commands, blocks, statuses, iterations and factorizations for each robot");
    expect(robots);
    double* block = blocks.data();
    const double* command = commands.data();
    std::int64_t *status = statuses.data(), *counted = iterations.data(), *factored = factorizations.data();
    const std::size_t size = batch_.layout().size;
    for (const int robot : robots) {
      expect_sound<D>(block + size * robot);
      expect_sound<D>(command + D * robot);
    }
    each(robots, [&](ccr::Continuation<D>& continuation, int k) {
      const int i = robots[k];
      const ccr::StepResult result = continuation.follow(block + size * i, command + D * i, block + size * i);
      status[i] = static_cast<int>(result.status);
      counted[i] = result.iterations;
      factored[i] = result.factorizations;
    });
  }

  void optimality(const Blocks& blocks, const Blocks& found) {
    const Turn turn(busy_);
    if (blocks.shape(0) != static_cast<std::size_t>(count_) || blocks.shape(1) != batch_.layout().size ||
        found.shape(0) != blocks.shape(0) || found.shape(1) != 3)
      throw std::invalid_argument("one row of three numbers for each robot");
    std::vector<int> all(count_);
    for (int i = 0; i < count_; ++i) expect_sound<D>(blocks.data() + batch_.layout().size * (all[i] = i));
    const double* block = blocks.data();
    double* to = found.data();
    each(all, [&](ccr::Continuation<D>& continuation, int k) {
      const ccr::Optimality at = continuation.optimality(block + batch_.layout().size * k);
      const double numbers[] = {at.stationarity, at.gap, at.complementarity};
      std::copy_n(numbers, 3, to + 3 * k);
    });
  }

  std::vector<int> reaches(const std::vector<int>& robots, const Values& forces, int obstacle, const Table& directions,
                           double increment, double limit, double length, const Blocks& reached) {
    const Turn turn(busy_);
    if (forces.shape(0) != robots.size() || directions.shape(0) != robots.size() || directions.shape(1) != D - 1 ||
        reached.shape(0) != robots.size() || reached.shape(1) != D)
      throw std::invalid_argument("one force, direction and force reached for each robot");
    expect(robots);
    std::vector<int> found(robots.size());
    const double *force = forces.data(), *direction = directions.data();
    double* to = reached.data();
    each(robots, [&](ccr::Continuation<D>& continuation, int k) {
      found[k] = continuation.ramp_reaches_force({force[k], obstacle, direction + (D - 1) * k, increment, limit, length}, to + D * k);
    });
    return found;
  }

 private:
  template <class Work>
  void each(const std::vector<int>& robots, Work work) {
    Interruption interruption;
    {
      nb::gil_scoped_release released;
      batch_.each(robots, work, interruption);
    }
    if (interruption.raised()) throw nb::python_error();
  }

  void expect(const std::vector<int>& robots) const {
    for (const int robot : robots)
      if (robot < 0 || robot >= count_) throw std::invalid_argument("robots of the fleet");
  }

  ccr::Batch<D> batch_;
  int count_, obstacles_;
  std::atomic_flag busy_;
};

template <int D>
void bind(nb::module_& m, const char* gaps, const char* scene, const char* kernel, const char* fleet) {
  m.def(gaps, &measure_gaps<D>, "kind"_a, "parameters"_a, "points"_a, "gaps"_a,
        "Write value and slope of the gap of each point to one obstacle.");
  nb::class_<Scene<D>>(m, scene, "Obstacles as the kernel takes them, each a row of the arrays.")
      .def("__init__",
           [](Scene<D>* self, const Kinds& kinds, const Input& parameters, const Input& extents, const Mask& touchable,
              const Input& springs, const Addresses& laws, const Outlines& outlines) {
             new (self) Scene<D>{read_obstacles<D>(kinds, parameters, extents, touchable, springs, laws, outlines)};
           },
           "kinds"_a, "parameters"_a, "extents"_a, "touchable"_a, "springs"_a, "laws"_a, "outlines"_a);
  nb::class_<Kernel<D>> solver(m, kernel, "Solver of one robot in one scene; holds scratch memory and no state between calls.");
  solver
      .def("__init__",
           [](Kernel<D>* self, const ccr::Robot& robot, const Scene<D>& scene) {
             new (self) Kernel<D>(robot, scene.obstacles);
           },
           "robot"_a, "scene"_a)
      .def_prop_ro("block_size", &Kernel<D>::block_size, "Length of an equilibrium's block.")
      .def("trace", &Kernel<D>::trace, "from_"_a, "command"_a,
           "Every shape accepted on the way: three numbers of each node, the points that can touch, displacements of the obstacles; and why the step was given up.")
      .def("optimality", &Kernel<D>::optimality, "block"_a, "Stationarity, gap and complementarity, without units.");
  constexpr const char* step = "Follow the branch from one block to a command into another; (status, iterations, factorizations).";
  if constexpr (D == 2)
    solver.def("step",
               [](Kernel<2>& self, const Input& from, double cable, double length, const Output& to) {
                 return self.step(from, {cable, length}, to);
               },
               "from_"_a, "cable"_a, "length"_a, "to"_a, step);
  else
    solver.def("step",
               [](Kernel<3>& self, const Input& from, double first, double second, double length, const Output& to) {
                 return self.step(from, {first, second, length}, to);
               },
               "from_"_a, "first"_a, "second"_a, "length"_a, "to"_a, step);
  nb::class_<Fleet<D>>(m, fleet, "Many robots alike, each in a scene of its own; their states are the caller's arrays.")
      .def("__init__",
           [](Fleet<D>* self, const ccr::Robot& robot, int count, int obstacles, int threads) {
             if (count < 1 || obstacles < 0 || threads < 1) throw std::invalid_argument("positive numbers");
             new (self) Fleet<D>(robot, count, obstacles, threads);
           },
           "robot"_a, "count"_a, "obstacles"_a, "threads"_a)
      .def("assign", [](Fleet<D>& self, int robot, const Scene<D>& scene) { self.assign(robot, scene.obstacles); },
           "robot"_a, "scene"_a, "Put a robot among other obstacles; its block stays as it is.")
      .def("step", &Fleet<D>::step, "robots"_a, "commands"_a, "blocks"_a, "statuses"_a, "iterations"_a,
           "factorizations"_a, "Move some robots to their commands (cables, length), in place.")
      .def("optimality", &Fleet<D>::optimality, "blocks"_a, "found"_a, "Stationarity, gap and complementarity of all robots.")
      .def("reaches", &Fleet<D>::reaches, "robots"_a, "forces"_a, "obstacle"_a, "directions"_a, "increment"_a, "limit"_a, "length"_a,
           "reached"_a, "Whether steady pulls of some robots from rest, along directions, reach their forces without an event.");
}

}  // namespace

NB_MODULE(_kernel, m) {
  nb::set_leak_warnings(false);  // of objects that caches keep until the interpreter ends
  m.doc() = "ContactProblem solver: Riccati-Newton SQP on the reduced coordinates, followed along a branch.";
  m.attr("SHAPES") = ccr::kShapeNames;
  m.attr("SHAPE_SIZE") = ccr::kShapeSize;
  m.attr("MAX_ACTIVE") = ccr::tolerances::kMaxActive;
  nb::class_<ccr::Robot>(m, "Robot", "A robot as the kernel takes it.")
      .def("__init__",
           [](ccr::Robot* self, bool rod, int segments, double offset, double angle, double rigidity,
              double max_tension, double max_length, double disk_radius, double disk_thickness,
              const std::vector<Numbers<2>>& lines, const std::vector<double>& edges, int between) {
             if (edges.size() != lines.size() || lines.empty()) throw std::invalid_argument("a longest edge for each line");
             std::vector<ccr::Vec<2>> places;
             for (const Numbers<2>& line : lines) places.push_back({line});
             new (self) ccr::Robot{rod ? ccr::ModelKind::kRod : ccr::ModelKind::kPaper, segments, offset, angle, rigidity, max_tension, max_length, disk_radius, disk_thickness, places,
                                  edges, between};
           },
           "sliding"_a, "segments"_a, "offset"_a, "angle"_a, "rigidity"_a, "max_tension"_a, "max_length"_a,
           "disk_radius"_a, "disk_thickness"_a, "lines"_a, "edges"_a, "between"_a);
  bind<2>(m, "measure_gaps", "Scene", "Kernel", "Fleet");
  bind<3>(m, "measure_spatial_gaps", "SpatialScene", "SpatialKernel", "SpatialFleet");
}
