#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <tuple>

#include "branch.hpp"

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
  }
  return obstacles;
}

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

class Kernel {
 public:
  Kernel(bool sliding, int segments, double offset, double rigidity, double max_tension, double max_length,
         const std::vector<double>& lines, int between, const Kinds& kinds, const Input& parameters,
         const Input& extents, const Mask& touchable, const Input& stiffness, const Addresses& laws) {
    const ccr::Robot robot{segments, offset, rigidity, max_tension, max_length, lines, between};
    const auto obstacles = read_obstacles(kinds, parameters, extents, touchable, stiffness, laws);
    if (sliding)
      branch_ = std::make_unique<ccr::Branch<ccr::SlidingCable>>(robot, obstacles);
    else
      branch_ = std::make_unique<ccr::Branch<ccr::UniformCable>>(robot, obstacles);
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

  std::unique_ptr<ccr::Follower> branch_;
};

}  // namespace

NB_MODULE(_kernel, m) {
  m.doc() = "Planar chain solver: Riccati-Newton SQP on the reduced coordinates, followed along a branch.";
  m.attr("SHAPE_SIZE") = ccr::kShapeSize;
  m.attr("MAX_ACTIVE") = ccr::limits::kMaxActive;
  m.def("measure_gaps", &measure_gaps, "kind"_a, "parameters"_a, "points"_a, "gaps"_a,
        "Write value, x and y slope of the gap of each point to one obstacle.");
  nb::class_<Kernel>(m, "Kernel", "Solver of one robot in one scene; holds scratch memory and no state between calls.")
      .def(nb::init<bool, int, double, double, double, double, const std::vector<double>&, int, const Kinds&,
                    const Input&, const Input&, const Mask&, const Input&, const Addresses&>(),
           "sliding"_a, "segments"_a, "offset"_a, "rigidity"_a, "max_tension"_a, "max_length"_a, "lines"_a,
           "between"_a, "kinds"_a, "parameters"_a, "extents"_a, "touchable"_a, "stiffness"_a, "laws"_a)
      .def_prop_ro("block_size", &Kernel::block_size, "Length of an equilibrium's block.")
      .def("step", &Kernel::step, "from_"_a, "cable"_a, "length"_a, "to"_a,
           "Follow the branch from one block to a cable displacement and length into another; returns (status, iterations).")
      .def("trace", &Kernel::trace, "from_"_a, "cable"_a, "length"_a,
           "Node poses of every shape accepted on the way, flattened.");
}
