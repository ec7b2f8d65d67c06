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

void expect(std::size_t size, std::size_t wanted) {
  if (size != wanted) throw std::invalid_argument("array of the wrong size for this robot and scene");
}

class Kernel {
 public:
  Kernel(int segments, double length, double offset, double stiffness, double max_tension, const Kinds& kinds,
         const Input& parameters, const Mask& touchable)
      : branch_({segments, length, offset, stiffness, max_tension}, read_obstacles(kinds, parameters, touchable)) {}

  std::tuple<int, int, double, double, double> step(double cable, const Input& shear, const Input& multipliers,
                                                    double target, const Output& shear_out,
                                                    const Output& multipliers_out, const Output& nodes_out,
                                                    const Output& cable_nodes_out, const Output& gaps_out) {
    load(cable, shear, multipliers);
    const ccr::Chain& chain = branch_.chain();
    const std::size_t nodes = chain.states().size();
    expect(shear_out.size(), nodes - 1);
    expect(multipliers_out.size(), chain.contacts());
    expect(gaps_out.size(), chain.contacts());
    expect(nodes_out.size(), 3 * nodes);
    expect(cable_nodes_out.size(), 2 * nodes);
    const ccr::Status status = branch_.follow(target);

    const ccr::Iterate& present = branch_.present;
    for (std::size_t i = 0; i + 1 < nodes; ++i) shear_out.data()[i] = present.shear[i][0];
    std::fill_n(multipliers_out.data(), chain.contacts(), 0.0);
    for (int j = 0; j < present.active.count; ++j)
      multipliers_out.data()[present.active.contact[j]] = present.active.multiplier[j];
    for (std::size_t i = 0; i < nodes; ++i) {
      std::copy_n(chain.states()[i].v.data(), 3, nodes_out.data() + 3 * i);
      std::copy_n(chain.points()[nodes + i].v.data(), 2, cable_nodes_out.data() + 2 * i);
    }
    for (int c = 0; c < chain.contacts(); ++c) gaps_out.data()[c] = chain.gaps()[c].value;
    return {static_cast<int>(status), branch_.iterations, present.cable, branch_.tension, chain.objective()};
  }

  std::vector<double> trace(double cable, const Input& shear, const Input& multipliers, double target) {
    load(cable, shear, multipliers);
    std::vector<double> shapes;
    branch_.trace = &shapes;
    branch_.follow(target);
    branch_.trace = nullptr;
    return shapes;
  }

 private:
  void load(double cable, const Input& shear, const Input& multipliers) {
    ccr::Iterate& present = branch_.present;
    expect(shear.size(), present.shear.size());
    expect(multipliers.size(), branch_.chain().contacts());
    present.cable = cable;
    for (std::size_t i = 0; i < shear.size(); ++i) present.shear[i][0] = shear.data()[i];
    present.active.count = 0;
    for (std::size_t c = 0; c < multipliers.size(); ++c) {
      if (!(multipliers.data()[c] > 0)) continue;
      if (present.active.count == ccr::limits::kMaxActive) throw std::invalid_argument("too many active contacts");
      present.active.contact[present.active.count] = static_cast<int>(c);
      present.active.multiplier[present.active.count++] = multipliers.data()[c];
    }
  }

  ccr::Branch branch_;
};

}  // namespace

NB_MODULE(_kernel, m) {
  m.doc() = "Planar chain solver: Riccati-Newton SQP on the reduced coordinates, followed along a branch.";
  nb::class_<Kernel>(m, "Kernel", "Solver of one robot in one scene; holds scratch memory and no state between calls.")
      .def(nb::init<int, double, double, double, double, const Kinds&, const Input&, const Mask&>(), "segments"_a,
           "length"_a, "offset"_a, "stiffness"_a, "max_tension"_a, "kinds"_a, "parameters"_a, "touchable"_a)
      .def("step", &Kernel::step, "cable"_a, "shear"_a, "multipliers"_a, "target"_a, "shear_out"_a, "multipliers_out"_a,
           "nodes_out"_a, "cable_nodes_out"_a, "gaps_out"_a,
           "Follow the branch to a cable displacement; returns (status, iterations, cable, tension, objective).")
      .def("trace", &Kernel::trace, "cable"_a, "shear"_a, "multipliers"_a, "target"_a,
           "Node poses of every shape accepted on the way, flattened.");
}
