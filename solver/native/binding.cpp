// The Python module solver._kernel.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>

#include "batch.hpp"
#include "tolerances.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Input = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using Output = nb::ndarray<double, nb::c_contig, nb::device::cpu>;
using Mask = nb::ndarray<const bool, nb::c_contig, nb::device::cpu>;
using Blocks = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Counts = nb::ndarray<std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

template <int D>
using Numbers = std::array<double, D>;  // a command: cables, then length

void require(bool condition, const std::string& message) {
  if (!condition) throw std::invalid_argument(message);
}

ccr::Robot make_robot(ccr::ModelKind model, int segments, double offset, double angle, double rigidity, double max_tension,
                      double max_length, double disk_radius, double disk_thickness, const std::vector<Numbers<2>>& lines,
                      const std::vector<double>& edges, int between) {
  require(edges.size() == lines.size() && !lines.empty(), "edges must name the longest edge of each line, of one at least");
  std::vector<ccr::Vec<2>> on_disk;
  for (const Numbers<2>& line : lines) on_disk.push_back({line});
  return {.model = model,
          .segments = segments,
          .offset = offset,
          .angle = angle,
          .rigidity = rigidity,
          .max_tension = max_tension,
          .max_length = max_length,
          .disk_radius = disk_radius,
          .disk_thickness = disk_thickness,
          .lines = std::move(on_disk),
          .edges = edges,
          .between = between};
}

template <int D>
ccr::Position<D> position(const double* numbers) {
  ccr::Position<D> out;
  std::copy_n(numbers, D, out.v.begin());
  return out;
}

std::array<double, ccr::kShapeSize> shape_parameters(const Input& parameters) {
  require(parameters.size() <= ccr::kShapeSize, "parameters are more than a shape has, SHAPE_SIZE");
  std::array<double, ccr::kShapeSize> out{};
  std::copy_n(parameters.data(), parameters.size(), out.begin());
  return out;
}

template <int D>
ccr::Obstacle<D> make_obstacle(ccr::Shape shape, const Input& parameters, const Numbers<D>& center, double radius,
                               double min_curvature_radius, double inradius, const Input& outline, const Mask& touchable,
                               const Input& spring, std::uintptr_t law) {
  require(spring.size() == D * D && outline.size() % D == 0, "spring is (d, d), outline (k, d)");
  const bool *first = touchable.data(), *last = first + touchable.size();
  ccr::Obstacle<D> obstacle{.shape = shape,
                            .parameters = shape_parameters(parameters),
                            .law = reinterpret_cast<ccr::Law>(law),
                            .center = {center},
                            .radius = radius,
                            .min_curvature_radius = min_curvature_radius,
                            .inradius = inradius,
                            .outline = {},
                            .touchable = {first, last},
                            .everywhere = std::find(first, last, false) == last,
                            .mounted = spring.data()[0] > 0,
                            .spring = {}};
  for (std::size_t k = 0; k < outline.size(); k += D) obstacle.outline.push_back(position<D>(outline.data() + k));
  std::copy_n(spring.data(), D * D, obstacle.spring.v.begin());
  return obstacle;
}

// Refuses obstacles that do not say of each point of a robot whether it can touch them.
template <int D>
void require_points(const ccr::BlockLayout& layout, const std::vector<ccr::Obstacle<D>>& obstacles) {
  for (const ccr::Obstacle<D>& obstacle : obstacles)
    require(obstacle.touchable.size() == layout.flags.size, "touchable must have an entry for each point of the robot, " +
                                                                std::to_string(layout.flags.size));
}

// Refuses commands that are not finite, and a length that is not positive.
template <int D>
void require_command(const double* command) {
  for (int k = 0; k < D; ++k)
    require(std::isfinite(command[k]), "a command, or that in the block of an equilibrium, is not finite");
  require(command[D - 1] > 0, "a length, or that in the block of an equilibrium, is not positive");
}

// Refuses blocks that no robot can have: the kernel needs a finite command and a positive length.
template <int D>
void require_sound(const ccr::BlockLayout& layout, const double* block) {
  Numbers<D> command;
  std::copy_n(block + layout.cables.offset, D - 1, command.begin());
  command[D - 1] = block[layout.length.offset];
  require_command<D>(command.data());
}

// Lets the interpreter handle signals now and then during a long call without its lock; true once one raised an error.
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

// Gaps of points (k, D) to one obstacle and their slopes: value and slope of each.
template <int D>
void measure_gaps(ccr::Shape shape, const Input& parameters, const Input& points, const Output& gaps) {
  require(points.size() % D == 0 && D * gaps.size() == (D + 1) * points.size(), "points (k, d) give gaps (k, d + 1)");
  ccr::Obstacle<D> obstacle{};
  obstacle.shape = shape;
  obstacle.parameters = shape_parameters(parameters);
  for (std::size_t k = 0; k < points.size() / D; ++k) {
    const ccr::Gap<D> gap = ccr::measure_gap(obstacle, position<D>(points.data() + D * k));
    double* to = gaps.data() + (D + 1) * k;
    *to = gap.value;
    std::copy_n(gap.slope.v.begin(), D, to + 1);
  }
}

// One robot in one scene.
template <int D>
class Kernel {
 public:
  Kernel(const ccr::Robot& robot, std::vector<ccr::Obstacle<D>> obstacles)
      : obstacles_(std::move(obstacles)),
        continuation_(ccr::make_continuation<D>(robot, static_cast<int>(obstacles_.size()))) {
    require_points(continuation_->layout(), obstacles_);
    continuation_->set_obstacles(obstacles_);
  }

  std::size_t block_size() const { return continuation_->layout().size; }

  std::tuple<ccr::Status, int, int> step(const Input& from, const Numbers<D>& command, const Output& to) {
    require_block(from);
    require_size(to.size());
    const ccr::StepResult result = continuation_->follow(from.data(), command.data(), to.data());
    return {result.status, result.iterations, result.factorizations};
  }

  std::tuple<std::vector<double>, ccr::Reason> trace(const Input& from, const Numbers<D>& command) {
    require_block(from);
    std::vector<double> shapes, to(block_size());
    const ccr::StepResult result = continuation_->trace(from.data(), command.data(), to.data(), shapes);
    return {std::move(shapes), result.reason};
  }

  Numbers<3> optimality(const Input& block) {
    require_block(block);
    const ccr::Optimality found = continuation_->optimality(block.data());
    return {found.stationarity, found.gap, found.complementarity};
  }

 private:
  void require_block(const Input& block) const {
    require_size(block.size());
    require_sound<D>(continuation_->layout(), block.data());
  }

  void require_size(std::size_t size) const {
    require(size == block_size(), "the block has " + std::to_string(size) + " numbers; that of this robot and scene has " +
                                      std::to_string(block_size()));
  }

  std::vector<ccr::Obstacle<D>> obstacles_;
  std::unique_ptr<ccr::Continuation<D>> continuation_;
};

template <int D>
void require_index(const ccr::Batch<D>& batch, int robot) {
  require(robot >= 0 && robot < batch.count(), "robot index " + std::to_string(robot) + " is out of range; the batch has " +
                                                   std::to_string(batch.count()) + " robots");
}

template <int D>
void require_blocks(const ccr::Batch<D>& batch, const Blocks& blocks) {
  require(blocks.shape(0) == static_cast<std::size_t>(batch.count()) && blocks.shape(1) == batch.layout().size,
          "blocks must be (" + std::to_string(batch.count()) + ", " + std::to_string(batch.layout().size) + ")");
}

// Works on these robots without the interpreter's lock, until a signal raises an error.
template <int D, class Work>
void each(ccr::Batch<D>& batch, const std::vector<int>& robots, Work work) {
  Interruption interruption;
  {
    nb::gil_scoped_release released;
    batch.each(robots, work, interruption);
  }
  if (interruption.raised()) throw nb::python_error();
}

template <int D>
void set_obstacles(ccr::Batch<D>& batch, int robot, std::vector<ccr::Obstacle<D>> obstacles) {
  const typename ccr::Batch<D>::Lock lock(batch);
  require_index(batch, robot);
  require(static_cast<int>(obstacles.size()) == batch.obstacles(),
          "the scene must have as many obstacles as the batch was made for, " + std::to_string(batch.obstacles()));
  require_points(batch.layout(), obstacles);
  batch.set_obstacles(robot, std::move(obstacles));
}

template <int D>
void step(ccr::Batch<D>& batch, const std::vector<int>& robots, const Table& commands, const Blocks& blocks,
          const Counts& statuses, const Counts& iterations, const Counts& factorizations) {
  const typename ccr::Batch<D>::Lock lock(batch);
  const std::size_t count = batch.count(), size = batch.layout().size;
  require_blocks(batch, blocks);
  require(commands.shape(0) == count && commands.shape(1) == D, "commands must have a row of cables and length for each robot");
  require(statuses.shape(0) == count && iterations.shape(0) == count && factorizations.shape(0) == count,
          "statuses, iterations and factorizations must have a number for each robot");
  double* block = blocks.data();
  const double* command = commands.data();
  std::int64_t *status = statuses.data(), *iterated = iterations.data(), *factored = factorizations.data();
  for (const int robot : robots) {
    require_index(batch, robot);
    require_sound<D>(batch.layout(), block + size * robot);
    require_command<D>(command + D * robot);
  }
  each(batch, robots, [&](ccr::Continuation<D>& continuation, int k) {
    const int i = robots[k];
    const ccr::StepResult result = continuation.follow(block + size * i, command + D * i, block + size * i);
    status[i] = static_cast<int>(result.status);
    iterated[i] = result.iterations;
    factored[i] = result.factorizations;
  });
}

template <int D>
void optimality(ccr::Batch<D>& batch, const Blocks& blocks, const Blocks& found) {
  const typename ccr::Batch<D>::Lock lock(batch);
  require_blocks(batch, blocks);
  require(found.shape(0) == blocks.shape(0) && found.shape(1) == 3, "found must have a row of three numbers for each robot");
  const std::size_t size = batch.layout().size;
  const double* block = blocks.data();
  double* to = found.data();
  std::vector<int> all(batch.count());
  std::iota(all.begin(), all.end(), 0);
  for (const int i : all) require_sound<D>(batch.layout(), block + size * i);
  each(batch, all, [&](ccr::Continuation<D>& continuation, int k) {
    const ccr::Optimality at = continuation.optimality(block + size * k);
    const double numbers[] = {at.stationarity, at.gap, at.complementarity};
    std::copy_n(numbers, 3, to + 3 * k);
  });
}

template <int D>
std::vector<int> ramps_reach_forces(ccr::Batch<D>& batch, const std::vector<int>& robots, const Values& forces, int obstacle,
                                    const Table& directions, double increment, double limit, double length,
                                    const Blocks& reached) {
  const typename ccr::Batch<D>::Lock lock(batch);
  const std::size_t count = robots.size();
  require(forces.shape(0) == count && directions.shape(0) == count && directions.shape(1) == D - 1 &&
              reached.shape(0) == count && reached.shape(1) == D,
          "forces (k), directions (k, cables) and reached (k, d) must have a row for each robot");
  for (const int robot : robots) require_index(batch, robot);
  std::vector<int> found(count);
  const double *force = forces.data(), *direction = directions.data();
  double* to = reached.data();
  each(batch, robots, [&](ccr::Continuation<D>& continuation, int k) {
    found[k] = continuation.ramp_reaches_force({.force = force[k],
                                                .obstacle = obstacle,
                                                .direction = direction + (D - 1) * k,
                                                .increment = increment,
                                                .limit = limit,
                                                .length = length},
                                               to + D * k);
  });
  return found;
}

// Names of what is bound for the plane and for space.
struct Names {
  const char *measure_gaps, *obstacle, *kernel, *batch;
};

template <int D>
void bind_kernel(nb::module_& m, const char* name) {
  nb::class_<Kernel<D>> kernel(m, name, "Solver of one robot in one scene. Holds scratch memory and no state between calls.");
  kernel.def(nb::init<const ccr::Robot&, std::vector<ccr::Obstacle<D>>>(), "robot"_a, "obstacles"_a)
      .def_prop_ro("block_size", &Kernel<D>::block_size, "Length of an equilibrium's block.")
      .def("trace", &Kernel<D>::trace, "from_"_a, "command"_a,
           "Return every shape accepted on the way, three numbers of each node, the points that can touch and the "
           "displacements of the obstacles, and why the step was given up.")
      .def("optimality", &Kernel<D>::optimality, "block"_a, "Return stationarity, gap and complementarity, without units.");
  constexpr const char* doc =
      "Follow the branch from one block to a command and write the equilibrium reached to another block. Return status, "
      "iterations and factorizations.";
  if constexpr (D == 2)
    kernel.def(
        "step",
        [](Kernel<2>& self, const Input& from, double cable, double length, const Output& to) {
          return self.step(from, {cable, length}, to);
        },
        "from_"_a, "cable"_a, "length"_a, "to"_a, doc);
  else
    kernel.def(
        "step",
        [](Kernel<3>& self, const Input& from, double first, double second, double length, const Output& to) {
          return self.step(from, {first, second, length}, to);
        },
        "from_"_a, "first"_a, "second"_a, "length"_a, "to"_a, doc);
}

template <int D>
void bind_batch(nb::module_& m, const char* name) {
  nb::class_<ccr::Batch<D>>(m, name, "Many robots alike, each in a scene of its own. Their states are the caller's arrays.")
      .def(
          "__init__",
          [](ccr::Batch<D>* self, const ccr::Robot& robot, int count, int obstacles, int threads) {
            require(count >= 1 && obstacles >= 0 && threads >= 1, "count and threads must be at least 1, obstacles 0");
            new (self) ccr::Batch<D>(robot, count, obstacles, threads);
          },
          "robot"_a, "count"_a, "obstacles"_a, "threads"_a)
      .def("set_obstacles", &set_obstacles<D>, "robot"_a, "obstacles"_a,
           "Put a robot among other obstacles. Its block stays as it is.")
      .def("step", &step<D>, "robots"_a, "commands"_a, "blocks"_a, "statuses"_a, "iterations"_a, "factorizations"_a,
           "Move some robots to their commands, cables and length, in place.")
      .def("optimality", &optimality<D>, "blocks"_a, "found"_a,
           "Write stationarity, gap and complementarity of all robots.")
      .def("ramps_reach_forces", &ramps_reach_forces<D>, "robots"_a, "forces"_a, "obstacle"_a, "directions"_a,
           "increment"_a, "limit"_a, "length"_a, "reached"_a,
           "Return whether steady pulls of some robots from rest, along directions, reach their forces without an event.");
}

template <int D>
void bind_space(nb::module_& m, const Names& names) {
  m.def(names.measure_gaps, &measure_gaps<D>, "shape"_a, "parameters"_a, "points"_a, "gaps"_a,
        "Write value and slope of the gap of each point to one obstacle.");
  nb::class_<ccr::Obstacle<D>>(m, names.obstacle, "An obstacle, and the points of a robot that can touch it.")
      .def(
          "__init__",
          [](ccr::Obstacle<D>* self, ccr::Shape shape, const Input& parameters, const Numbers<D>& center, double radius,
             double min_curvature_radius, double inradius, const Input& outline, const Mask& touchable,
             const Input& spring, std::uintptr_t law) {
            new (self) ccr::Obstacle<D>(make_obstacle<D>(shape, parameters, center, radius, min_curvature_radius, inradius,
                                                         outline, touchable, spring, law));
          },
          nb::kw_only(), "shape"_a, "parameters"_a, "center"_a, "radius"_a, "min_curvature_radius"_a, "inradius"_a,
          "outline"_a, "touchable"_a, "spring"_a, "law"_a);
  bind_kernel<D>(m, names.kernel);
  bind_batch<D>(m, names.batch);
}

void bind_enums(nb::module_& m) {
  nb::enum_<ccr::ModelKind>(m, "Model", "The model of a robot.")
      .value("PAPER", ccr::ModelKind::kPaper)
      .value("ROD", ccr::ModelKind::kRod)
      .value("SPATIAL", ccr::ModelKind::kSpatial);
  nb::enum_<ccr::Status>(m, "Status", nb::is_arithmetic(), "How a step ended.")
      .value("CONVERGED", ccr::Status::kConverged)
      .value("SNAPPED", ccr::Status::kSnapped)
      .value("STALLED", ccr::Status::kStalled)
      .value("BLOCKED", ccr::Status::kBlocked)
      .value("GAVE_UP", ccr::Status::kGaveUp);
  nb::enum_<ccr::Reason>(m, "Reason", "Why a step was given up.")
      .value("NONE", ccr::Reason::kNone)
      .value("FOLDED", ccr::Reason::kFolded)
      .value("WORK", ccr::Reason::kWork)
      .value("STUCK", ccr::Reason::kStuck);
  nb::enum_<ccr::Shape>(m, "Shape", "The shape of an obstacle.")
      .value("CIRCLE", ccr::Shape::kCircle)
      .value("HALF_PLANE", ccr::Shape::kHalfPlane)
      .value("ELLIPSE", ccr::Shape::kEllipse)
      .value("CAPSULE", ccr::Shape::kCapsule)
      .value("POLYGON", ccr::Shape::kPolygon)
      .value("SPHERE", ccr::Shape::kSphere)
      .value("HALF_SPACE", ccr::Shape::kHalfSpace)
      .value("SPATIAL_CAPSULE", ccr::Shape::kSpatialCapsule)
      .value("CYLINDER", ccr::Shape::kCylinder)
      .value("BOX", ccr::Shape::kBox)
      .value("CUSTOM", ccr::Shape::kCustom);
}

void bind_layout(nb::module_& m) {
  nb::class_<ccr::BlockField>(m, "BlockField", "A field of an equilibrium's block: an array that begins at an offset.")
      .def_prop_ro("name", [](const ccr::BlockField& field) { return std::string(field.name); })
      .def_ro("offset", &ccr::BlockField::offset)
      .def_ro("size", &ccr::BlockField::size)
      .def_prop_ro("shape", [](const ccr::BlockField& field) { return nb::tuple(nb::cast(field.shape)); },
                   nb::sig("def shape(self, /) -> tuple[int, ...]"));
  m.def(
      "block_layout",
      [](ccr::ModelKind model, int segments, int lines, int positions, int obstacles) {
        return ccr::make_block_layout(
                   model, {.segments = segments, .lines = lines, .positions = positions, .obstacles = obstacles})
            .fields();
      },
      "model"_a, "segments"_a, "lines"_a, "positions"_a, "obstacles"_a,
      "Return the fields of an equilibrium's block, in their order.");
}

}  // namespace

NB_MODULE(_kernel, m) {
  nb::set_leak_warnings(false);  // of objects that caches keep until the interpreter ends
  m.doc() = "Equilibria of a robot among obstacles: a Riccati-Newton active-set method, continued along a branch.";
  m.attr("SHAPE_SIZE") = ccr::kShapeSize;
  bind_enums(m);
  bind_layout(m);
  nb::class_<ccr::Robot>(m, "Robot", "A robot.")
      .def(
          "__init__",
          [](ccr::Robot* self, ccr::ModelKind model, int segments, double offset, double angle, double rigidity,
             double max_tension, double max_length, double disk_radius, double disk_thickness,
             const std::vector<Numbers<2>>& lines, const std::vector<double>& edges, int between) {
            new (self) ccr::Robot(make_robot(model, segments, offset, angle, rigidity, max_tension, max_length, disk_radius,
                                             disk_thickness, lines, edges, between));
          },
          nb::kw_only(), "model"_a, "segments"_a, "offset"_a, "angle"_a, "rigidity"_a, "max_tension"_a, "max_length"_a,
          "disk_radius"_a, "disk_thickness"_a, "lines"_a, "edges"_a, "between"_a);
  bind_space<2>(m, {"measure_gaps", "Obstacle", "Kernel", "Batch"});
  bind_space<3>(m, {"measure_spatial_gaps", "SpatialObstacle", "SpatialKernel", "SpatialBatch"});
}
