#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <tuple>

#include "batch.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Input = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using Output = nb::ndarray<double, nb::c_contig, nb::device::cpu>;
using Mask = nb::ndarray<const bool, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Kinds = std::vector<int>;
using Addresses = std::vector<std::uintptr_t>;

template <int D>
using Numbers = std::array<double, D>;  // a command: cables, then length

template <int D>
std::vector<ccr::Obstacle<D>> read_obstacles(const Kinds& kinds, const Input& parameters, const Input& extents,
                                             const Mask& touchable, const Input& stiffness, const Addresses& laws) {
  const std::size_t count = kinds.size(), points = touchable.shape(1);
  if (parameters.size() != ccr::kShapeSize * count || extents.size() != (D + 2) * count || touchable.shape(0) != count ||
      stiffness.size() != D * D * count || laws.size() != count)
    throw std::invalid_argument("one row of parameters, extents, touchable points, stiffness and law per obstacle");
  std::vector<ccr::Obstacle<D>> obstacles(count);
  for (std::size_t i = 0; i < count; ++i) {
    ccr::Obstacle<D>& obstacle = obstacles[i];
    const double* extent = extents.data() + (D + 2) * i;
    obstacle.shape = static_cast<ccr::Shape>(kinds[i]);
    std::copy_n(parameters.data() + ccr::kShapeSize * i, ccr::kShapeSize, obstacle.parameters.begin());
    std::copy_n(extent, D, obstacle.center.v.begin());
    obstacle.radius = extent[D];
    obstacle.fineness = extent[D + 1];
    std::copy_n(stiffness.data() + D * D * i, D * D, obstacle.stiffness.v.begin());
    obstacle.law = reinterpret_cast<ccr::Law>(laws[i]);
    obstacle.mounted = obstacle.stiffness(0, 0) > 0;
    obstacle.touchable.assign(touchable.data() + points * i, touchable.data() + points * (i + 1));
    const auto& can = obstacle.touchable;
    obstacle.everywhere = std::find(can.begin(), can.end(), 0) == can.end();
  }
  return obstacles;
}

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
      : scene_(std::move(scene)), branch_(ccr::make_follower<D>(robot, static_cast<int>(scene_.size()))) {
    branch_->enter(scene_);
  }

  std::size_t block_size() const { return branch_->block_size(); }

  std::tuple<int, int> step(const Input& from, const Numbers<D>& command, const Output& to) {
    expect(from.size());
    expect(to.size());
    const ccr::Status status = branch_->follow(from.data(), command.data(), to.data());
    return {static_cast<int>(status), branch_->iterations};
  }

  std::vector<double> trace(const Input& from, const Numbers<D>& command) {
    expect(from.size());
    std::vector<double> shapes, to(branch_->block_size());
    branch_->trace = &shapes;
    branch_->follow(from.data(), command.data(), to.data());
    branch_->trace = nullptr;
    return shapes;
  }

 private:
  void expect(std::size_t size) const {
    if (size != branch_->block_size()) throw std::invalid_argument("block of the wrong size for this robot and scene");
  }

  std::vector<ccr::Obstacle<D>> scene_;
  std::unique_ptr<ccr::Follower<D>> branch_;
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
    if (robot < 0 || robot >= count_ || static_cast<int>(scene.size()) != obstacles_)
      throw std::invalid_argument("a robot of the fleet, and as many obstacles as it was made for");
    batch_.scene(robot) = std::move(scene);
  }

  void step(const std::vector<int>& robots, const Table& commands, const Blocks& blocks, const Counts& statuses,
            const Counts& iterations) {
    const std::size_t count = count_;
    if (commands.shape(0) != count || commands.shape(1) != D || blocks.shape(0) != count ||
        blocks.shape(1) != batch_.block_size() || statuses.shape(0) != count || iterations.shape(0) != count)
      throw std::invalid_argument("one row of commands, blocks, statuses and iterations for each robot");
    expect(robots);
    double* block = blocks.data();
    const double* command = commands.data();
    std::int64_t *status = statuses.data(), *counted = iterations.data();
    const std::size_t size = batch_.block_size();
    nb::gil_scoped_release released;
    batch_.each(robots, [&](ccr::Follower<D>& follower, int k) {
      const int i = robots[k];
      status[i] = static_cast<int>(follower.follow(block + size * i, command + D * i, block + size * i));
      counted[i] = follower.iterations;
    });
  }

  std::vector<int> reaches(const std::vector<int>& robots, const Values& forces, int obstacle, const Table& directions,
                           double increment, double limit, double length, const Blocks& reached) {
    if (forces.shape(0) != robots.size() || directions.shape(0) != robots.size() || directions.shape(1) != D - 1 ||
        reached.shape(0) != robots.size() || reached.shape(1) != D)
      throw std::invalid_argument("one force, direction and force reached for each robot");
    expect(robots);
    std::vector<int> found(robots.size());
    const double *force = forces.data(), *direction = directions.data();
    double* to = reached.data();
    nb::gil_scoped_release released;
    batch_.each(robots, [&](ccr::Follower<D>& follower, int k) {
      found[k] = follower.reaches(force[k], obstacle, direction + (D - 1) * k, increment, limit, length, to + D * k);
    });
    return found;
  }

 private:
  void expect(const std::vector<int>& robots) const {
    for (const int robot : robots)
      if (robot < 0 || robot >= count_) throw std::invalid_argument("robots of the fleet");
  }

  ccr::Batch<D> batch_;
  int count_, obstacles_;
};

template <int D>
void bind(nb::module_& m, const char* gaps, const char* scene, const char* kernel, const char* fleet) {
  m.def(gaps, &measure_gaps<D>, "kind"_a, "parameters"_a, "points"_a, "gaps"_a,
        "Write value and slope of the gap of each point to one obstacle.");
  nb::class_<Scene<D>>(m, scene, "Obstacles as the kernel takes them, each a row of the arrays.")
      .def("__init__",
           [](Scene<D>* self, const Kinds& kinds, const Input& parameters, const Input& extents, const Mask& touchable,
              const Input& stiffness, const Addresses& laws) {
             new (self) Scene<D>{read_obstacles<D>(kinds, parameters, extents, touchable, stiffness, laws)};
           },
           "kinds"_a, "parameters"_a, "extents"_a, "touchable"_a, "stiffness"_a, "laws"_a);
  nb::class_<Kernel<D>> solver(m, kernel, "Solver of one robot in one scene; holds scratch memory and no state between calls.");
  solver
      .def("__init__",
           [](Kernel<D>* self, const ccr::Robot& robot, const Scene<D>& scene) {
             new (self) Kernel<D>(robot, scene.obstacles);
           },
           "robot"_a, "scene"_a)
      .def_prop_ro("block_size", &Kernel<D>::block_size, "Length of an equilibrium's block.")
      .def("trace", &Kernel<D>::trace, "from_"_a, "command"_a,
           "Three numbers of each node of every shape accepted on the way, flattened.");
  constexpr const char* step = "Follow the branch from one block to a command into another; (status, iterations).";
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
           "Move some robots to their commands (cables, length), in place.")
      .def("reaches", &Fleet<D>::reaches, "robots"_a, "forces"_a, "obstacle"_a, "directions"_a, "increment"_a, "limit"_a, "length"_a,
           "reached"_a, "Whether steady pulls of some robots from rest, along directions, reach their forces without an event.");
}

}  // namespace

NB_MODULE(_kernel, m) {
  nb::set_leak_warnings(false);  // of objects that caches keep until the interpreter ends
  m.doc() = "Chain solver: Riccati-Newton SQP on the reduced coordinates, followed along a branch.";
  m.attr("SHAPES") = ccr::kShapeNames;
  m.attr("SHAPE_SIZE") = ccr::kShapeSize;
  m.attr("MAX_ACTIVE") = ccr::limits::kMaxActive;
  nb::class_<ccr::Robot>(m, "Robot", "A robot as the kernel takes it.")
      .def("__init__",
           [](ccr::Robot* self, bool sliding, int segments, double offset, double angle, double rigidity,
              double max_tension, double max_length, const std::vector<Numbers<2>>& lines, int between) {
             std::vector<ccr::Vec<2>> places;
             for (const Numbers<2>& line : lines) places.push_back({line});
             new (self) ccr::Robot{sliding, segments, offset, angle, rigidity, max_tension, max_length, places, between};
           },
           "sliding"_a, "segments"_a, "offset"_a, "angle"_a, "rigidity"_a, "max_tension"_a, "max_length"_a, "lines"_a,
           "between"_a);
  bind<2>(m, "measure_gaps", "Scene", "Kernel", "Fleet");
  bind<3>(m, "measure_spatial_gaps", "SpatialScene", "SpatialKernel", "SpatialFleet");
}
