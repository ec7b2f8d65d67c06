#include "solve/contact_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/models.hpp"

namespace ccr {

template <class Model>
ContactProblem<Model>::ContactProblem(const Robot& robot, int obstacles)
    : robot_(robot),
      model_(robot),
      controls_(robot.segments),
      origin_(robot.segments + 1),
      clear_(obstacles),
      nodes_(robot.segments + 1),
      points_(robot.points()),
      gaps_(obstacles * points_.size() + Model::kRod * (robot.rod.cables.size() + Model::kDiskSides * robot.segments),
            std::numeric_limits<double>::infinity()),
      mount_of_(obstacles, -1),
      node_forces_(robot.segments + 1) {
  kept_tensions_.v.fill(HUGE_VAL);
  near_.reserve(gaps_.size());
  set_robot(robot);
}

template <class Model>
void ContactProblem<Model>::set_robot(const Robot& robot) {
  robot_ = robot;
  model_.set_robot(robot);
  evaluated_ = false;
  const int stride = robot.between + 1;
  sites_.clear();
  farthest_line_ = 0;
  for (const Vec<2>& line : robot.lines) {
    for (int k = 0; k < robot.positions(); ++k)
      sites_.push_back({k / stride, static_cast<double>(k % stride) / stride, line});
    farthest_line_ = std::max(farthest_line_, norm(line));
  }
  reach_ = farthest_line_ + tolerances::kReach * robot.max_length +
           (robot.between > 0 ? robot.max_length / robot.segments : 0);
}

template <class Model>
void ContactProblem<Model>::set_obstacles(std::span<const Obstacle> obstacles) {
  obstacles_ = obstacles;
  evaluated_ = false;
  motions_ = {};
  largest_motion_ = 0;
  for (const int contact : near_) gaps_[contact] = std::numeric_limits<double>::infinity();
  near_.clear();
  int mounts = 0;
  for (std::size_t j = 0; j < obstacles.size(); ++j) mount_of_[j] = obstacles[j].mounted ? mounts++ : -1;
  springs_.resize(mounts);
  mount_origin_.resize(mounts);
  displacements_.resize(mounts);
  mount_gradient_.resize(mounts);
}

template <class Model>
bool ContactProblem<Model>::evaluate(const Iterate& at) {
  if (is_evaluated(at)) return true;
  evaluated_ = has_gradient_ = false;
  if (!model_.evaluate(at.command, at.controls)) return false;
  loaded_ = at.command.loads;
  if (is_moving()) place_obstacles(at.command.scene);
  update_springs(at.mounts);
  if constexpr (Model::kRod) energy_ -= load_work() + (keeps_tensions_ ? kept_work() : 0.0);
  barrier_energy_ = 0;
  if (barrier_enabled_) add_barrier(at.controls);
  for (int i = 0; i <= robot_.segments; ++i)
    for (int k = 0; k < kSpace; ++k) nodes_[i][k] = states()[i][k];
  all_placed_ = false;
  measure_gaps();
  if constexpr (Model::kRod) measure_slacks_and_disks(at.command);
  command_ = at.command;
  controls_ = at.controls;
  evaluated_ = true;
  return true;
}

// The barrier is kBarrierCurvature/2 · max(0, s - kBarrierShear)², s the squared shear over that of a segment that
// folds over.
template <class Model>
void ContactProblem<Model>::add_barrier(const std::vector<Control>& controls) {
  barrier_slope_.assign(controls.size(), {});
  barrier_curvature_.assign(controls.size(), {});
  const double square = model_.widest_shear() * model_.widest_shear();
  for (std::size_t i = 0; i < controls.size(); ++i) {
    double shear = 0;
    for (int k = 0; k < Model::kShears; ++k) shear += controls[i][k] * controls[i][k];
    const double excess = shear / square - tolerances::kBarrierShear;
    if (excess <= 0) continue;
    barrier_energy_ += tolerances::kBarrierCurvature * excess * excess / 2;
    const double rise = 2 * tolerances::kBarrierCurvature / square;
    for (int r = 0; r < Model::kShears; ++r) {
      barrier_slope_[i][r] = rise * excess * controls[i][r];
      barrier_curvature_[i](r, r) = rise * excess;
      for (int c = 0; c < Model::kShears; ++c)
        barrier_curvature_[i](r, c) += 2 * rise / square * controls[i][r] * controls[i][c];
    }
  }
  energy_ += barrier_energy_;
}

template <class Model>
void ContactProblem<Model>::update_springs(const std::vector<Position>& mounts) {
  displacements_ = mounts;
  for (std::size_t j = 0; j < obstacles_.size(); ++j)
    if (const int mount = mount_of_[j]; mount >= 0)
      for (int k = 0; k < kSpace * kSpace; ++k) springs_[mount][k] = obstacles_[j].spring[k] / energy_scale();
  energy_ = objective() + spring_energy(mounts, model_.segment_length() * robot_.segments);
}

template <class Model>
double ContactProblem<Model>::spring_energy(const std::vector<Position>& mounts, double length) const {
  double energy = 0;
  for (std::size_t j = 0; j < obstacles_.size(); ++j)
    if (const int mount = mount_of_[j]; mount >= 0)
      energy += dot(mounts[mount], times(obstacles_[j].spring, mounts[mount])) / 2;
  return energy / robot_.energy_scale(length);
}

template <class Model>
void ContactProblem<Model>::set_free_shape(Iterate& at) {
  at.active.count = 0;
  std::fill(at.mounts.begin(), at.mounts.end(), Position{});
  Control control{};
  if constexpr (Model::kRod)
    if (at.command.cables[0] > 0) {
      control = model_.free_control(at.command);
      at.active.contact[0] = slack_contact(0);
      at.active.multiplier[0] = model_.free_slack_multiplier();
      at.active.count = 1;
    }
  std::fill(at.controls.begin(), at.controls.end(), control);
}

template <class Model>
ContactProblem<Model>::Position ContactProblem<Model>::point(int contact) const {
  const int mount = this->mount(contact);
  if (std::isinf(gaps_[contact])) place_all();  // an active contact that is out of reach now
  const Position& point = points_[contact % points_.size()];
  return mount < 0 ? point : minus(point, displacements_[mount]);
}

template <class Model>
Gap<ContactProblem<Model>::kSpace> ContactProblem<Model>::gap(int contact) const {
  return measure_gap(obstacle(contact), point(contact));
}

template <class Model>
ContactProblem<Model>::Slope ContactProblem<Model>::slope(int contact) const {
  if constexpr (Model::kRod) {
    if (is_slack(contact)) return {{}, -1, {}, model_.cables().minus_slopes(contact - contacts()).data()};
    if (contact >= first_disk_contact()) {  // a function of the rotation between two nodes
      const int segment = disk_segment(contact);
      const auto moment = model_.disk_moment(segment, disk_gap(contact));
      State lower{}, upper{};
      for (int k = 0; k < Model::kTurn; ++k) {
        lower[kSpace + k] = -moment[k];
        upper[kSpace + k] = moment[k];
      }
      return {{segment, true, lower, upper}, -1, {}};
    }
  }
  const Position normal = gap(contact).slope;
  return {force(contact, normal), mount(contact), normal};
}

template <class Model>
ContactProblem<Model>::Force ContactProblem<Model>::force(int contact, const Position& on_point) const {
  const Site& site = this->site(contact);
  const auto share = [&](double weight, int node) {
    State share{};
    const auto turn = moment(lever(site, node), on_point);
    for (int k = 0; k < kSpace; ++k) share[k] = weight * on_point[k];
    for (int k = 0; k < Model::kTurn; ++k) share[kSpace + k] = weight * turn[k];
    return share;
  };
  const double t = site.fraction;
  if (t == 0) return {site.node, false, share(1, site.node), {}};
  return {site.node, true, share(1 - t, site.node), share(t, site.node + 1)};
}

template <class Model>
double ContactProblem<Model>::lever_arm(int contact) const {
  if (is_slack(contact)) return robot_.offset * robot_.segments;
  if (contact >= first_disk_contact()) return robot_.disk_radius;
  const Site& site = this->site(contact);
  return model_.segment_length() * (site.node + (site.fraction > 0));
}

template <class Model>
bool ContactProblem<Model>::touches_obstacle(const ActiveSet& active) const {
  const auto begin = active.contact.begin();
  return std::any_of(begin, begin + active.count, [this](int contact) { return contact < contacts(); });
}

template <class Model>
double ContactProblem<Model>::violation() const {
  double worst = 0;
  for (const int contact : near_) worst = std::max(worst, -gaps_[contact]);
  return worst;
}

template <class Model>
double ContactProblem<Model>::stationarity_tolerance(const ActiveSet& active) const {
  const double scale = Model::kRod ? std::max(model_.max_objective_slope + load_slope_, tolerances::kUnbent)
                                   : model_.free_turn() * model_.free_turn();
  double pressed = Model::kRod ? std::max(scale, kept_slope_)
                               : model_.max_objective_slope;  // largest slope, of the objective or of a contact
  for (int j = 0; j < active.count; ++j)
    pressed = std::max(pressed, active.multiplier[j] * lever_arm(active.contact[j]));
  return tolerances::kStationarity * scale + tolerances::kRoundoff * pressed;
}

template <class Model>
void ContactProblem<Model>::reduced_gradient(const ActiveSet& active) {
  if (has_gradient_ && pressed_ == active) return;
  has_gradient_ = true;
  pressed_ = active;
  std::fill(node_forces_.begin(), node_forces_.end(), State{});
  Tensions slack_multipliers = kept_multipliers_;
  if constexpr (Model::kRod) add_loads(node_forces_);
  for (std::size_t m = 0; m < springs_.size(); ++m) mount_gradient_[m] = times(springs_[m], displacements_[m]);
  for (int j = 0; j < active.count; ++j) {
    if constexpr (Model::kRod)
      if (active.contact[j] >= contacts()) {
        if (is_slack(active.contact[j])) slack_multipliers[active.contact[j] - contacts()] = active.multiplier[j];
        continue;
      }
    const auto& [force, mount, normal, minus_controls] = slope(active.contact[j]);
    if (mount >= 0)
      for (int k = 0; k < kSpace; ++k) mount_gradient_[mount][k] += active.multiplier[j] * normal[k];
    for (int k = 0; k < kState; ++k) {
      node_forces_[force.node][k] += active.multiplier[j] * force.here[k];
      if (force.split) node_forces_[force.node + 1][k] += active.multiplier[j] * force.next[k];
    }
  }
  model_.propagate_adjoints(node_forces_);
  if constexpr (Model::kRod) {
    model_.add_slacks(slack_multipliers);
    push_disks(active);
  }
  if (in_barrier())
    for (std::size_t i = 0; i < barrier_slope_.size(); ++i) model_.gradient[i] += barrier_slope_[i];
}

// Adds the contacts of disks to the gradient. They are functions of their segment's control, so they stay out of the
// adjoints, whose part of the Hessian would be that of moments which turn with the disks.
template <class Model>
void ContactProblem<Model>::push_disks(const ActiveSet& active) requires(Model::kRod) {
  for (int j = 0; j < active.count; ++j) {
    if (active.contact[j] < first_disk_contact()) continue;
    const int segment = disk_segment(active.contact[j]);
    const Control slope = model_.disk_slope(segment, disk_gap(active.contact[j]));
    for (int k = 0; k < Model::kControl; ++k) model_.gradient[segment][k] -= active.multiplier[j] * slope[k];
  }
}

template <class Model>
void ContactProblem<Model>::lagrangian_hessian(const ActiveSet& active, System& system) const {
  model_.lagrangian_hessian(system);
  if constexpr (Model::kRod) add_load_curvature(system);
  if (in_barrier())
    for (std::size_t i = 0; i < barrier_curvature_.size(); ++i) system.stages[i].huu += barrier_curvature_[i];
  for (int j = 0; j < active.count; ++j) {
    const int contact = active.contact[j];
    if constexpr (Model::kRod)
      if (contact >= first_disk_contact()) {
        const int segment = disk_segment(contact);
        auto curvature = model_.disk_curvature(segment, disk_gap(contact));
        for (double& entry : curvature.v) entry *= active.multiplier[j];
        system.stages[segment].huu -= curvature;
      }
    if (contact >= contacts()) continue;  // the model has the curvature of the slacks
    const Gap<kSpace> gap = this->gap(contact);
    const Site& site = this->site(contact);
    const double scale = -active.multiplier[j];
    // -λ∇²c in the states of the nodes beside the point: J_aᵀ C J_b, and the second derivative of each lever's
    // rotation.
    const auto motion = [&](double weight, int node) {
      Mat<kSpace, kState> slope;
      const auto turn = swing(lever(site, node));
      for (int r = 0; r < kSpace; ++r) {
        slope(r, r) = weight;
        for (int k = 0; k < Model::kTurn; ++k) slope(r, kSpace + k) = weight * turn(r, k);
      }
      return slope;
    };
    const auto add_turn = [&](double weight, int node) {
      const auto turn = hessian_contraction(lever(site, node), gap.slope);
      for (int r = 0; r < Model::kTurn; ++r)
        for (int k = 0; k < Model::kTurn; ++k)
          system.node_hessian[node](kSpace + r, kSpace + k) += scale * weight * turn(r, k);
    };
    const double t = site.fraction;
    const int node = site.node;
    const Mat<kSpace, kSpace> c = gap.curvature(scale);
    const auto here = motion(1 - t, node);
    system.node_hessian[node] += transpose_times(here, times(c, here));
    add_turn(1 - t, node);
    if (t == 0) continue;
    const auto next = motion(t, node + 1);
    system.node_hessian[node + 1] += transpose_times(next, times(c, next));
    add_turn(t, node + 1);
    system.couple(node, transpose_times(here, times(c, next)));
  }
}

template <class Model>
ContactProblem<Model>::Tensions ContactProblem<Model>::tensions(const ActiveSet& active) const {
  Tensions tensions = Model::kRod ? kept_multipliers_ : model_.displacement_slopes();
  if constexpr (Model::kRod)
    for (int j = 0; j < active.count; ++j)
      if (is_slack(active.contact[j])) tensions[active.contact[j] - contacts()] = active.multiplier[j];
  for (double& tension : tensions.v) tension *= energy_scale();
  return tensions;
}

template <class Model>
ContactProblem<Model>::Position ContactProblem<Model>::contact_force(const ActiveSet& active, int obstacle) const {
  Position force{};
  for (int j = 0; j < active.count; ++j) {
    if (active.contact[j] >= contacts() || active.contact[j] / static_cast<int>(points_.size()) != obstacle) continue;
    const Gap<kSpace> gap = this->gap(active.contact[j]);
    for (int k = 0; k < kSpace; ++k) force[k] += energy_scale() * active.multiplier[j] * gap.slope[k];
  }
  return force;
}

template <class Model>
ContactProblem<Model>::Position ContactProblem<Model>::mount_load(const ActiveSet& active, int mount) const {
  Position load{};
  for (int j = 0; j < active.count; ++j)
    if (this->mount(active.contact[j]) == mount) {
      const Position normal = slope(active.contact[j]).normal;
      for (int k = 0; k < kSpace; ++k) load[k] += active.multiplier[j] * normal[k];
    }
  return load;
}

#define CCR_INSTANTIATE(Model) template class ContactProblem<Model>;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
