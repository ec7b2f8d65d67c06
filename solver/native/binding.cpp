#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
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

std::vector<ccr::Obstacle> read_obstacles(const Kinds& kinds, const Input& parameters, const Input& extents,
                                          const Mask& touchable, const Input& stiffness, const Addresses& laws) {
  const std::size_t count = kinds.size(), points = touchable.shape(1);
  if (parameters.size() != ccr::kShapeSize * count || extents.size() != 4 * count || touchable.shape(0) != count ||
      stiffness.size() != 4 * count || laws.size() != count)
    throw std::invalid_argument("one row of parameters, extents, touchable points, stiffness and law per obstacle");
  std::vector<ccr::Obstacle> obstacles(count);
  for (std::size_t i = 0; i < count; ++i) {
    ccr::Obstacle& obstacle = obstacles[i];
    const double* extent = extents.data() + 4 * i;
    obstacle.shape = static_cast<ccr::Shape>(kinds[i]);
    std::copy_n(parameters.data() + ccr::kShapeSize * i, ccr::kShapeSize, obstacle.parameters.begin());
    obstacle.center = {{extent[0], extent[1]}};
    obstacle.radius = extent[2];
    obstacle.fineness = extent[3];
    std::copy_n(stiffness.data() + 4 * i, 4, obstacle.stiffness.v.begin());
    obstacle.law = reinterpret_cast<ccr::Law>(laws[i]);
    obstacle.mounted = obstacle.stiffness(0, 0) > 0;
    obstacle.touchable.assign(touchable.data() + points * i, touchable.data() + points * (i + 1));
    const auto& can = obstacle.touchable;
    obstacle.everywhere = std::find(can.begin(), can.end(), 0) == can.end();
  }
  return obstacles;
}

struct Scene {
  std::vector<ccr::Obstacle> obstacles;
};

// Gaps of points (k, 2) to one obstacle and their slopes: value, x, y of each.
void measure_gaps(int kind, const Input& parameters, const Input& points, const Output& gaps) {
  if (parameters.size() > ccr::kShapeSize || points.size() % 2 || 2 * gaps.size() != 3 * points.size())
    throw std::invalid_argument("points (k, 2) give gaps (k, 3)");
  ccr::Obstacle obstacle{};
  obstacle.shape = static_cast<ccr::Shape>(kind);
  std::copy_n(parameters.data(), parameters.size(), obstacle.parameters.begin());
  for (std::size_t k = 0; k < points.size() / 2; ++k) {
    const ccr::Gap gap = ccr::measure_gap(obstacle, {{points.data()[2 * k], points.data()[2 * k + 1]}});
    const double values[] = {gap.value, gap.x, gap.y};
    std::copy_n(values, 3, gaps.data() + 3 * k);
  }
}

// One robot in one scene.
class Kernel {
 public:
  Kernel(bool sliding, const ccr::Robot& robot, std::vector<ccr::Obstacle> scene)
      : scene_(std::move(scene)), branch_(ccr::make_follower(sliding, robot, static_cast<int>(scene_.size()))) {
    branch_->enter(scene_);
  }

  std::size_t block_size() const { return branch_->block_size(); }

  std::tuple<int, int> step(const Input& from, double cable, double length, const Output& to) {
    expect(from.size());
    expect(to.size());
    const ccr::Status status = branch_->follow(from.data(), {cable, length}, to.data());
    return {static_cast<int>(status), branch_->iterations};
  }

  std::vector<double> trace(const Input& from, double cable, double length) {
    expect(from.size());
    std::vector<double> shapes, to(branch_->block_size());
    branch_->trace = &shapes;
    branch_->follow(from.data(), {cable, length}, to.data());
    branch_->trace = nullptr;
    return shapes;
  }

 private:
  void expect(std::size_t size) const {
    if (size != branch_->block_size()) throw std::invalid_argument("block of the wrong size for this robot and scene");
  }

  std::vector<ccr::Obstacle> scene_;
  std::unique_ptr<ccr::Follower> branch_;
};

using Blocks = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Commands = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Counts = nb::ndarray<std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// Robots alike in scenes of equally many obstacles; their blocks and commands are the caller's arrays.
class Fleet {
 public:
  Fleet(bool sliding, const ccr::Robot& robot, int count, int obstacles, int threads)
      : batch_(sliding, robot, count, obstacles, threads), count_(count), obstacles_(obstacles) {}

  void assign(int robot, std::vector<ccr::Obstacle> scene) {
    if (robot < 0 || robot >= count_ || static_cast<int>(scene.size()) != obstacles_)
      throw std::invalid_argument("a robot of the fleet, and as many obstacles as it was made for");
    batch_.scene(robot) = std::move(scene);
  }

  void step(const std::vector<int>& robots, const Commands& commands, const Blocks& blocks, const Counts& statuses,
            const Counts& iterations) {
    const std::size_t count = count_;
    if (commands.shape(0) != count || commands.shape(1) != 2 || blocks.shape(0) != count ||
        blocks.shape(1) != batch_.block_size() || statuses.shape(0) != count || iterations.shape(0) != count)
      throw std::invalid_argument("one row of commands, blocks, statuses and iterations for each robot");
    expect(robots);
    double* block = blocks.data();
    const double* command = commands.data();
    std::int64_t *status = statuses.data(), *counted = iterations.data();
    const std::size_t size = batch_.block_size();
    nb::gil_scoped_release released;
    batch_.each(robots, [&](ccr::Follower& follower, int k) {
      const int i = robots[k];
      const ccr::Command target{command[2 * i], command[2 * i + 1]};
      status[i] = static_cast<int>(follower.follow(block + size * i, target, block + size * i));
      counted[i] = follower.iterations;
    });
  }

  std::vector<int> reaches(const std::vector<int>& robots, const Values& forces, double increment, double limit,
                           double length) {
    if (forces.shape(0) != robots.size()) throw std::invalid_argument("one force for each robot");
    expect(robots);
    std::vector<int> found(robots.size());
    const double* force = forces.data();
    nb::gil_scoped_release released;
    batch_.each(robots, [&](ccr::Follower& follower, int k) {
      found[k] = follower.reaches(force[k], increment, limit, length);
    });
    return found;
  }

 private:
  void expect(const std::vector<int>& robots) const {
    for (const int robot : robots)
      if (robot < 0 || robot >= count_) throw std::invalid_argument("robots of the fleet");
  }

  ccr::Batch batch_;
  int count_, obstacles_;
};

}  // namespace

NB_MODULE(_kernel, m) {
  m.doc() = "Planar chain solver: Riccati-Newton SQP on the reduced coordinates, followed along a branch.";
  m.attr("SHAPE_SIZE") = ccr::kShapeSize;
  m.attr("MAX_ACTIVE") = ccr::limits::kMaxActive;
  m.def("measure_gaps", &measure_gaps, "kind"_a, "parameters"_a, "points"_a, "gaps"_a,
        "Write value, x and y slope of the gap of each point to one obstacle.");
  nb::class_<ccr::Robot>(m, "Robot", "A robot as the kernel takes it.")
      .def("__init__",
           [](ccr::Robot* self, int segments, double offset, double rigidity, double max_tension, double max_length,
              const std::vector<double>& lines, int between) {
             new (self) ccr::Robot{segments, offset, rigidity, max_tension, max_length, lines, between};
           },
           "segments"_a, "offset"_a, "rigidity"_a, "max_tension"_a, "max_length"_a, "lines"_a, "between"_a);
  nb::class_<Scene>(m, "Scene", "Obstacles as the kernel takes them, each a row of the arrays.")
      .def("__init__",
           [](Scene* self, const Kinds& kinds, const Input& parameters, const Input& extents, const Mask& touchable,
              const Input& stiffness, const Addresses& laws) {
             new (self) Scene{read_obstacles(kinds, parameters, extents, touchable, stiffness, laws)};
           },
           "kinds"_a, "parameters"_a, "extents"_a, "touchable"_a, "stiffness"_a, "laws"_a);
  nb::class_<Kernel>(m, "Kernel", "Solver of one robot in one scene; holds scratch memory and no state between calls.")
      .def("__init__",
           [](Kernel* self, bool sliding, const ccr::Robot& robot, const Scene& scene) {
             new (self) Kernel(sliding, robot, scene.obstacles);
           },
           "sliding"_a, "robot"_a, "scene"_a)
      .def_prop_ro("block_size", &Kernel::block_size, "Length of an equilibrium's block.")
      .def("step", &Kernel::step, "from_"_a, "cable"_a, "length"_a, "to"_a,
           "Follow the branch from one block to a cable displacement and length into another; (status, iterations).")
      .def("trace", &Kernel::trace, "from_"_a, "cable"_a, "length"_a,
           "Node poses of every shape accepted on the way, flattened.");
  nb::class_<Fleet>(m, "Fleet", "Many robots alike, each in a scene of its own; their states are the caller's arrays.")
      .def("__init__",
           [](Fleet* self, bool sliding, const ccr::Robot& robot, int count, int obstacles, int threads) {
             if (count < 1 || obstacles < 0 || threads < 1) throw std::invalid_argument("positive numbers");
             new (self) Fleet(sliding, robot, count, obstacles, threads);
           },
           "sliding"_a, "robot"_a, "count"_a, "obstacles"_a, "threads"_a)
      .def("assign", [](Fleet& self, int robot, const Scene& scene) { self.assign(robot, scene.obstacles); }, "robot"_a,
           "scene"_a, "Put a robot among other obstacles; its block stays as it is.")
      .def("step", &Fleet::step, "robots"_a, "commands"_a, "blocks"_a, "statuses"_a, "iterations"_a,
           "Move some robots to their commands (cable, length), in place.")
      .def("reaches", &Fleet::reaches, "robots"_a, "forces"_a, "increment"_a, "limit"_a, "length"_a,
           "Whether steady pulls of some robots from rest reach their forces without an event.");
}
