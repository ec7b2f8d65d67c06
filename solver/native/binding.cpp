#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
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

std::vector<ccr::Obstacle> read_obstacles(const Kinds& kinds, const Input& parameters, const Mask& touchable) {
  if (parameters.size() != 3 * kinds.size() || touchable.shape(0) != kinds.size())
    throw std::invalid_argument("one row of parameters and of touchable nodes per obstacle");
  std::vector<ccr::Obstacle> obstacles;
  const std::size_t nodes = touchable.shape(1);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const double* p = parameters.data() + 3 * i;
    const bool* t = touchable.data() + nodes * i;
    obstacles.push_back({static_cast<ccr::Shape>(kinds[i]), {p[0], p[1], p[2]}, {t, t + nodes}});
  }
  return obstacles;
}

class Kernel {
 public:
  Kernel(int segments, double length, double offset, double stiffness, double max_tension, const Kinds& kinds,
         const Input& parameters, const Mask& touchable)
      : branch_({segments, length, offset, stiffness, max_tension}, read_obstacles(kinds, parameters, touchable)) {}

  std::size_t block_size() const { return branch_.block_size(); }

  std::tuple<int, int> step(const Input& from, double target, const Output& to) {
    expect(from.size());
    expect(to.size());
    const ccr::Status status = branch_.follow(from.data(), target, to.data());
    return {static_cast<int>(status), branch_.iterations};
  }

  std::vector<double> trace(const Input& from, double target) {
    expect(from.size());
    std::vector<double> shapes, to(branch_.block_size());
    branch_.trace = &shapes;
    branch_.follow(from.data(), target, to.data());
    branch_.trace = nullptr;
    return shapes;
  }

 private:
  void expect(std::size_t size) const {
    if (size != branch_.block_size()) throw std::invalid_argument("block of the wrong size for this robot and scene");
  }

  ccr::Branch branch_;
};

}  // namespace

NB_MODULE(_kernel, m) {
  m.doc() = "Planar chain solver: Riccati-Newton SQP on the reduced coordinates, followed along a branch.";
  nb::class_<Kernel>(m, "Kernel", "Solver of one robot in one scene; holds scratch memory and no state between calls.")
      .def(nb::init<int, double, double, double, double, const Kinds&, const Input&, const Mask&>(), "segments"_a,
           "length"_a, "offset"_a, "stiffness"_a, "max_tension"_a, "kinds"_a, "parameters"_a, "touchable"_a)
      .def_prop_ro("block_size", &Kernel::block_size, "Length of an equilibrium's block.")
      .def("step", &Kernel::step, "from_"_a, "target"_a, "to"_a,
           "Follow the branch from one block to a cable displacement into another; returns (status, iterations).")
      .def("trace", &Kernel::trace, "from_"_a, "target"_a,
           "Node poses of every shape accepted on the way, flattened.");
}
