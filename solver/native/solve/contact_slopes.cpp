// How the gaps and loads of a robot change with the parameters of an equilibrium.
#include "model/models.hpp"
#include "solve/contact_problem.hpp"

namespace ccr {

namespace {

// Motion of a point at some distance from an axis, where it turns about the k-th axis by a unit.
Position<2> turned(int, const Position<2>& offset) { return {{-offset[1], offset[0]}}; }
Position<3> turned(int k, const Position<3>& offset) {
  Position<3> axis;
  axis[k] = 1;
  return cross(axis, offset);
}

// Motion of the end of a lever that turns with a state.
template <class State>
Position<2> swung(const State& rate, const Position<2>& lever) {
  return {{-rate[2] * lever[1], rate[2] * lever[0]}};
}
Position<3> swung(const Vec<6>& rate, const Position<3>& lever) {
  return cross(Vec<3>{{rate[3], rate[4], rate[5]}}, lever);
}

}  // namespace

template <class Model>
ContactProblem<Model>::Position ContactProblem<Model>::velocity(int contact, const std::vector<State>& rates) const {
  const Site& site = this->site(contact);
  Position out;
  const auto add = [&](double weight, int node) {
    const Position turn = swung(rates[node], lever(site, node));
    for (int k = 0; k < kSpace; ++k) out[k] += weight * (rates[node][k] + turn[k]);
  };
  add(1 - site.fraction, site.node);
  if (site.fraction > 0) add(site.fraction, site.node + 1);
  return out;
}

template <class Model>
void ContactProblem<Model>::add_coupling(int contact, double multiplier,
                                         std::vector<InputSlope<Model>>& segments) const {
  const Site& site = this->site(contact);
  if (site.fraction == 0) return;
  const State& rate = segments[site.node].upper;
  const Position turn = swung(rate, lever(site, site.node + 1));
  Position moved;
  for (int k = 0; k < kSpace; ++k) moved[k] = site.fraction * (rate[k] + turn[k]);
  segments[site.node].lower += force(contact, times(gap(contact).curvature(-multiplier), moved)).here;
}

template <class Model>
GapRate<ContactProblem<Model>::kSpace> ContactProblem<Model>::gap_rate(int contact, int motion,
                                                                       const Gap<kSpace>& gap) const {
  const Obstacle& obstacle = this->obstacle(contact);
  const Position at = point(contact);
  if (motion == kMotions - 1) return growth_slope(obstacle, at);
  const bool turns = motion >= kSpace;
  Position shift;
  if (turns)
    shift = turned(motion - kSpace, minus(at, obstacle.center));
  else
    shift[motion] = 1;
  GapRate<kSpace> rate{-dot(gap.slope, shift), times(gap.curvature(-1), shift)};
  if (turns) rate.slope += turned(motion - kSpace, gap.slope);
  return rate;
}

// Over the energy scale, which falls with the length, a load grows with it, and the weight of a segment once more.
template <class Model>
void ContactProblem<Model>::add_load_growth(std::vector<State>& node_slopes, std::vector<State>& forces) const {
  if constexpr (Model::kRod) {
    const int n = robot_.segments;
    const double length = n * model_.segment_length(), scale = loaded_ / energy_scale();
    forces.assign(node_slopes.size(), {});
    add_loads(forces);
    for (int i = 1; i <= n; ++i) {
      for (int k = 0; k < kState; ++k) node_slopes[i][k] -= forces[i][k] / length;
      for (int k = 0; k < kSpace; ++k) node_slopes[i][k] -= scale * (i < n ? 1 : 0.5) * robot_.rod.weight[k] / n;
    }
  }
}

#define CCR_INSTANTIATE(Model)                                                                                         \
  template ContactProblem<Model>::Position ContactProblem<Model>::velocity(int, const std::vector<State>&) const;      \
  template void ContactProblem<Model>::add_coupling(int, double, std::vector<InputSlope<Model>>&) const;               \
  template GapRate<ContactProblem<Model>::kSpace> ContactProblem<Model>::gap_rate(int, int, const Gap<kSpace>&) const; \
  template void ContactProblem<Model>::add_load_growth(std::vector<State>&, std::vector<State>&) const;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
