// The Python module solver._kernel.
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <string>
#include <vector>

#include "batch_calls.hpp"
#include "kernel.hpp"
#include "kernel_input.hpp"
#include "transition_binding.hpp"

using namespace nanobind::literals;

namespace ccr::binding {

namespace {

// Names of what is bound for the plane and for space.
struct Names {
  const char *measure_gaps, *obstacle, *kernel, *batch;
};

template <int D>
void bind_kernel(nb::module_& m, const char* name) {
  nb::class_<Kernel<D>> kernel(m, name,
                               "Solver of one robot in one scene. Holds scratch memory and no state between calls.");
  kernel.def(nb::init<const Robot&, std::vector<Obstacle<D>>>(), "robot"_a, "obstacles"_a)
      .def_prop_ro("block_size", &Kernel<D>::block_size, "Length of an equilibrium's block.")
      .def("trace", &Kernel<D>::trace, "from_"_a, "command"_a,
           "Return every shape accepted on the way, three numbers of each node, the points that can touch and the "
           "displacements of the obstacles, and why the step was given up.")
      .def("optimality", &Kernel<D>::optimality, "block"_a,
           "Return stationarity, gap and complementarity, without units.")
      .def_prop_ro("slopes_shape", &Kernel<D>::slopes_shape,
                   "Numbers of parameters of an equilibrium and of their slopes.")
      .def("slopes", &Kernel<D>::slopes, "block"_a, "held"_a.none(), "to"_a,
           "Write the slopes of an equilibrium in each parameter, while contacts stay closed. Return whether they were "
           "found, and how many closed gaps were left out that the others imply.")
      .def("move", &Kernel<D>::move, "from_"_a, "command"_a, "origins"_a, "towards"_a, "motions"_a, "to"_a,
           "Step while the obstacles move from some to others. Return also which part of their way they have gone.")
      .def("rest", &Kernel<D>::rest, "length"_a, "to"_a,
           "Write the equilibrium at a length with no cable displaced. Return status, iterations and factorizations.")
      .def("step", &Kernel<D>::step, "from_"_a, "command"_a, "to"_a,
           "Follow the branch from one block to a command, cables and length, and write the equilibrium reached to "
           "another block. Return status, iterations and factorizations.");
}

template <int D>
void bind_batch(nb::module_& m, const char* name) {
  nb::class_<Batch<D>>(m, name,
                       "Many robots of one layout, each in a scene of its own. Their states are the caller's arrays.")
      .def(
          "__init__",
          [](Batch<D>* self, const Robot& robot, int count, int obstacles, int threads) {
            require(count >= 1 && obstacles >= 0 && threads >= 1, "count and threads must be at least 1, obstacles 0");
            new (self) Batch<D>(robot, count, obstacles, threads);
          },
          "robot"_a, "count"_a, "obstacles"_a, "threads"_a)
      .def("set_obstacles", &set_obstacles<D>, "robot"_a, "obstacles"_a,
           "Put a robot among other obstacles. Its block stays as it is.")
      .def("set_robot", &set_robot<D>, "index"_a, "robot"_a.none(),
           "Make a robot another one with a block of the same fields; None for that of the batch. Its block stays.")
      .def("copy", &copy<D>, "other"_a, "robots"_a,
           "Make robots those of another batch of equal robots, and put them among the same obstacles. Blocks stay.")
      .def("rest", &rest<D>, "robots"_a, "lengths"_a, "blocks"_a, "statuses"_a, "iterations"_a, "factorizations"_a,
           "Bring some robots to rest, each at its length, in place.")
      .def(
          "move", &move<D>, "robots"_a, "motions"_a, "commands"_a, "blocks"_a, "parts"_a, "statuses"_a, "iterations"_a,
          "factorizations"_a, "slopes"_a = nb::none(), "found"_a = nb::none(),
          "Move some robots to their commands while their obstacles move to others, in place. Each motion is where the "
          "obstacles go to, and bounds on how far their surfaces go.")
      .def("step", &step<D>, "robots"_a, "commands"_a, "blocks"_a, "statuses"_a, "iterations"_a, "factorizations"_a,
           "slopes"_a = nb::none(), "found"_a = nb::none(),
           "Move some robots to their commands, cables and length, in place. Write the slopes of these steps in their "
           "commands, if there are arrays for them: for each cable, and where there is one more row for the length, "
           "those "
           "of `slopes` and that of the clearance.")
      .def("slopes", &slopes<D>, "robots"_a, "blocks"_a, "slopes"_a, "found"_a,
           "Write the slopes of the equilibria of some robots in their commands, cables and length, and whether they "
           "were "
           "found.")
      .def_prop_ro(
          "slope_row", [](const Batch<D>& batch) { return batch.slope_row(); }, "Numbers of the slopes in a parameter.")
      .def("optimality", &optimality<D>, "blocks"_a, "found"_a,
           "Write stationarity, gap and complementarity of all robots.")
      .def("ramps_reach_forces", &ramps_reach_forces<D>, "robots"_a, "forces"_a, "obstacle"_a, "directions"_a,
           "increment"_a, "limit"_a, "lengths"_a, "reached"_a,
           "Return whether steady pulls of some robots from rest, along directions, reach their forces without an "
           "event.");
}

template <int D>
void bind_space(nb::module_& m, const Names& names) {
  m.def(names.measure_gaps, &measure_gaps<D>, "shape"_a, "parameters"_a, "points"_a, "gaps"_a,
        "Write value and slope of the gap of each point to one obstacle.");
  nb::class_<Obstacle<D>>(m, names.obstacle, "An obstacle, and the points of a robot that can touch it.")
      .def(
          "__init__",
          [](Obstacle<D>* self, Shape shape, const Input& parameters, const Numbers<D>& center, double radius,
             double min_curvature_radius, double inradius, const std::optional<Input>& outline,
             const std::optional<Mask>& touchable, const std::optional<Input>& spring, std::uintptr_t law) {
            new (self) Obstacle<D>(make_obstacle<D>(shape, parameters, center, radius, min_curvature_radius, inradius,
                                                    outline, touchable, spring, law));
          },
          nb::kw_only(), "shape"_a, "parameters"_a, "center"_a, "radius"_a, "min_curvature_radius"_a, "inradius"_a,
          "outline"_a.none(), "touchable"_a.none(), "spring"_a.none(), "law"_a);
  bind_kernel<D>(m, names.kernel);
  bind_batch<D>(m, names.batch);
}

void bind_enums(nb::module_& m) {
  nb::enum_<ModelKind>(m, "Model", "The model of a robot.")
      .value("PLANAR_PAPER", ModelKind::kPlanarPaper)
      .value("PLANAR_ROD", ModelKind::kPlanarRod)
      .value("SPATIAL_PAPER", ModelKind::kSpatialPaper)
      .value("SPATIAL_ROD", ModelKind::kSpatialRod);
  nb::enum_<Status>(m, "Status", nb::is_arithmetic(), "How a step ended.")
      .value("CONVERGED", Status::kConverged)
      .value("SNAPPED", Status::kSnapped)
      .value("STALLED", Status::kStalled)
      .value("BLOCKED", Status::kBlocked)
      .value("GAVE_UP", Status::kGaveUp);
  nb::enum_<Reason>(m, "Reason", "Why a step was given up.")
      .value("NONE", Reason::kNone)
      .value("FOLDED", Reason::kFolded)
      .value("WORK", Reason::kWork)
      .value("STUCK", Reason::kStuck);
  nb::enum_<Shape>(m, "Shape", "The shape of an obstacle.")
      .value("CIRCLE", Shape::kCircle)
      .value("HALF_PLANE", Shape::kHalfPlane)
      .value("ELLIPSE", Shape::kEllipse)
      .value("CAPSULE", Shape::kCapsule)
      .value("POLYGON", Shape::kPolygon)
      .value("SPHERE", Shape::kSphere)
      .value("HALF_SPACE", Shape::kHalfSpace)
      .value("SPATIAL_CAPSULE", Shape::kSpatialCapsule)
      .value("CYLINDER", Shape::kCylinder)
      .value("BOX", Shape::kBox)
      .value("CUSTOM", Shape::kCustom);
}

void bind_layout(nb::module_& m) {
  nb::class_<BlockField>(m, "BlockField", "A field of an equilibrium's block: an array that begins at an offset.")
      .def_prop_ro("name", [](const BlockField& field) { return std::string(field.name); })
      .def_ro("offset", &BlockField::offset)
      .def_ro("size", &BlockField::size)
      .def_prop_ro(
          "shape", [](const BlockField& field) { return nb::tuple(nb::cast(field.shape)); },
          nb::sig("def shape(self, /) -> tuple[int, ...]"));
  m.def(
      "block_layout",
      [](ModelKind model, int segments, int cables, int lines, int positions, int obstacles) {
        return make_block_layout(model, {.segments = segments,
                                         .cables = cables,
                                         .lines = lines,
                                         .positions = positions,
                                         .obstacles = obstacles})
            .fields();
      },
      "model"_a, "segments"_a, "cables"_a, "lines"_a, "positions"_a, "obstacles"_a,
      "Return the fields of an equilibrium's block, in their order.");
}

void bind_robot(nb::module_& m) {
  m.attr("MAX_CABLES") = kMaxCables;
  nb::class_<Load>(m, "Load", "A dead load on the disk of a node.")
      .def(
          "__init__",
          [](Load* self, int node, const Numbers<2>& at, const Numbers<3>& force, double moment) {
            new (self) Load{node, {at}, {force}, moment};
          },
          nb::kw_only(), "node"_a, "at"_a, "force"_a, "moment"_a);
  nb::class_<Rod>(m, "Rod", "What a rod has beyond a robot of the paper's model.")
      .def(nb::init<>())
      .def(
          "__init__",
          [](Rod* self, const std::vector<Numbers<2>>& holes, const std::vector<int>& ends, const Input& stiffness,
             const Input& rest, const Numbers<3>& weight, const std::vector<Load>& loads, double least_pull,
             double bounded_twist) {
            new (self) Rod(make_rod(holes, ends, stiffness, rest, weight, loads, least_pull, bounded_twist));
          },
          nb::kw_only(), "holes"_a, "ends"_a, "stiffness"_a, "rest"_a, "weight"_a, "loads"_a, "least_pull"_a,
          "bounded_twist"_a);
  nb::class_<Robot>(m, "Robot", "A robot.")
      .def(
          "__init__",
          [](Robot* self, ModelKind model, int segments, double offset, double angle, double rigidity,
             double max_tension, double max_length, double disk_radius, double disk_thickness,
             const std::vector<Numbers<2>>& lines, const std::vector<double>& edges, int between, const Rod& rod) {
            new (self) Robot(make_robot(model, segments, offset, angle, rigidity, max_tension, max_length, disk_radius,
                                        disk_thickness, lines, edges, between, rod));
          },
          nb::kw_only(), "model"_a, "segments"_a, "offset"_a, "angle"_a, "rigidity"_a, "max_tension"_a, "max_length"_a,
          "disk_radius"_a, "disk_thickness"_a, "lines"_a, "edges"_a, "between"_a, "rod"_a);
}

}  // namespace

}  // namespace ccr::binding

NB_MODULE(_kernel, m) {
  using namespace ccr::binding;
  namespace nb = nanobind;
  nb::set_leak_warnings(false);  // of objects that caches keep until the interpreter ends
  m.doc() = "Equilibria of a robot among obstacles: a Riccati-Newton active-set method, continued along a branch.";
  m.attr("SHAPE_SIZE") = ccr::kShapeSize;
  bind_enums(m);
  bind_layout(m);
  bind_robot(m);
  bind_space<2>(m, {"measure_gaps", "Obstacle", "Kernel", "Batch"});
  bind_space<3>(m, {"measure_spatial_gaps", "SpatialObstacle", "SpatialKernel", "SpatialBatch"});
  bind_transitions(m);
}
