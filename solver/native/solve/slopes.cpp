#include "solve/slopes.hpp"

#include <algorithm>

#include "model/models.hpp"

namespace ccr {

template <class Model>
Slopes<Model>::Slopes(int segments, int mounts)
    : segments_(segments), mounts_(mounts), kkt_(segments, mounts), qp_(segments, mounts), laws_(segments) {
  kkt_.counts_inertia = true;
  for (Input& input : inputs_) {
    input.moved.resize(segments + 1);
    input.node_slopes.resize(segments + 1);
    input.gradient.resize(segments);
    input.mounts.resize(mounts);
  }
}

// Factors the KKT system of an equilibrium and of the gaps that stay closed; false where it is singular. A robot of the
// paper's models that nothing touches needs none: it does not shear, whatever its cables and its length are.
template <class Model>
bool Slopes<Model>::factor(const ContactProblem& problem, const Iterate& at, const ActiveSet& held) {
  kkt_.assemble(problem, at.active, 0);
  held_ = held;
  still_ = !Model::kRod && at.active.count + held.count == 0 &&
           std::all_of(at.controls.begin(), at.controls.end(), [](const Control& u) { return u.v == Control{}.v; });
  reach_ = 0;
  if (still_) return true;
  if (!kkt_.factor(0)) return false;
  reach_ = problem.has_loads() ? segments_ : kkt_.system().idle();
  if (held.count == 0) return true;
  const auto cables_held = [&](const ActiveSet& gaps) {
    const auto begin = gaps.contact.begin();
    return std::count_if(begin, begin + gaps.count, [&](int contact) { return problem.is_slack(contact); });
  };
  if (qp_.hold(problem, kkt_, held_) < tolerances::kToDifferentiate) return false;
  return cables_held(held_) == cables_held(held);  // taut cables that lock the robot cannot be moved alone
}

template <class Model>
int Slopes<Model>::differentiate(const ContactProblem& problem, const Iterate& at, const ActiveSet& held,
                                 const SlopeRequest& request, double* rows) {
  if (!factor(problem, at, held)) return -1;
  const int cables = cables_ = Model::kRod ? static_cast<int>(problem.robot().rod.cables.size()) : kCables;
  find_touches(problem, at);
  asked_ = request.length ? kInputs : kInputs - 1;
  if (asked_ > 0) problem.input_slopes(at, asked_, laws_);
  for (int k = 0; k < asked_; ++k) find_input(problem, at, k);
  if constexpr (!Model::kRod) find_within();
  used_ = 0;
  add_cable_rows(problem.contacts(), cables);
  if (request.length) add_input_row(cables, kInputs - 1);
  const int obstacles = static_cast<int>(problem.obstacles().size()), moving = request.obstacles ? obstacles : 0;
  for (int j = 0; j < moving; ++j)
    for (int motion = 0; motion < kMotions; ++motion) add_obstacle_row(problem, j, motion, cables + request.length);
  respond();
  const SlopeRow<Model> fields(segments_, problem.contacts(), cables, obstacles);
  const int size = fields.size() + request.gap;
  std::fill_n(rows, (cables + request.length + kMotions * moving) * size, 0.0);
  for (int k = 0; k < used_; ++k) {
    double* to = rows + rows_[k].parameter * size;
    finish(problem, at, rows_[k], to);
    if (request.contact >= 0) to[fields.size()] = gap_slope(problem, request.contact, rows_[k]);
  }
  if (moving > 0 && request.contact >= 0) add_own_motion(problem, request.contact, rows + size - 1, size);
  return held.count - held_.count;
}

template <class Model>
void Slopes<Model>::find_touches(const ContactProblem& problem, const Iterate& at) {
  touches_.clear();
  const auto add = [&](int contact, double multiplier, int index) {
    if (contact >= problem.contacts()) return;
    for (Touch& touch : touches_)
      if (touch.contact == contact) {
        touch.held = index;
        return;
      }
    const int obstacle = contact / problem.robot().points();
    touches_.push_back({contact, obstacle, problem.mount_of(obstacle), multiplier, index, problem.gap(contact)});
  };
  for (int j = 0; j < at.active.count; ++j) add(at.active.contact[j], at.active.multiplier[j], -1);
  for (int j = 0; j < held_.count; ++j) add(held_.contact[j], 0, j);
}

template <class Model>
void Slopes<Model>::find_input(const ContactProblem& problem, const Iterate& at, int number) {
  Input& input = inputs_[number];
  const bool is_length = number == kInputs - 1;
  for (const Touch& touch : touches_)
    if (touch.multiplier != 0) problem.add_coupling(touch.contact, touch.multiplier, laws_.segment[number]);
  move_nodes(laws_.segment[number], input);
  if (Model::kRod && problem.has_loads()) problem.add_load_growth(input.node_slopes, load_forces_);
  pull_back(laws_.segment[number], input);
  for (int m = 0; m < mounts_; ++m) {
    input.mounts[m] = is_length ? times(problem.spring(m), at.mounts[m]) : Position{};
    for (double& slope : input.mounts[m].v) slope /= at.command.length;
  }
  std::fill_n(input.gaps.begin(), held_.count, 0.0);
  for (const Touch& touch : touches_) {
    const Position velocity = problem.velocity(touch.contact, input.moved);
    if (touch.mount >= 0) input.mounts[touch.mount] += times(touch.gap.curvature(touch.multiplier), velocity);
    if (touch.held >= 0) input.gaps[touch.held] = dot(touch.gap.slope, velocity);
  }
  if constexpr (Model::kRod) add_own_gaps(problem, at.active, input);
}

// Moves the nodes at fixed controls, and finds the slope of the Lagrangian in their states.
template <class Model>
void Slopes<Model>::move_nodes(const std::vector<InputSlope<Model>>& laws, Input& input) const {
  const auto& system = kkt_.system();
  for (int i = 0; i < segments_; ++i) {
    input.moved[i + 1] = times(system.stages[i].a, input.moved[i]);
    input.moved[i + 1] += laws[i].upper;
  }
  for (int i = 0; i < reach_; ++i) {
    input.node_slopes[i + 1] = times(system.node_hessian[i + 1], input.moved[i + 1]);
    if (i + 1 < segments_) input.node_slopes[i + 1] += laws[i + 1].lower;
  }
}

// Carries these slopes back to the controls.
template <class Model>
void Slopes<Model>::pull_back(const std::vector<InputSlope<Model>>& laws, Input& input) const {
  State force;
  for (int i = segments_ - 1; i >= reach_; --i) input.gradient[i] = laws[i].own;
  for (int i = reach_ - 1; i >= 0; --i) {
    const auto& stage = kkt_.system().stages[i];
    force += input.node_slopes[i + 1];
    input.gradient[i] = laws[i].own;
    input.gradient[i] += times(stage.hux, input.moved[i]);
    input.gradient[i] += transpose_times(stage.b, force);
    force = transpose_times(stage.a, force);
  }
}

// Adds what a rod's slacks and the gaps between its disks change with the length.
template <class Model>
void Slopes<Model>::add_own_gaps(const ContactProblem& problem, const ActiveSet& active, Input& input) const {
  if constexpr (Model::kRod) {
    for (int j = 0; j < held_.count; ++j) {
      const int contact = held_.contact[j];
      if (problem.is_slack(contact)) input.gaps[j] = laws_.slack[contact - problem.contacts()];
      if (contact >= problem.first_disk_contact()) input.gaps[j] = problem.disk_length_slope(contact).value;
    }
    for (int j = 0; j < active.count; ++j) {
      const int contact = active.contact[j];
      if (contact < problem.first_disk_contact()) continue;
      const Control slope = problem.disk_length_slope(contact).slope;
      Control& gradient = input.gradient[problem.disk_segment(contact)];
      for (int k = 0; k < Model::kControl; ++k) gradient[k] -= active.multiplier[j] * slope[k];
    }
  }
}

template <class Model>
void Slopes<Model>::find_within() {
  within_ = laws_.curvature;
  for (int r = 0; r < asked_; ++r)
    for (int c = 0; c < asked_; ++c)
      for (int i = 1; i <= reach_; ++i) {
        within_(r, c) += dot(inputs_[r].node_slopes[i], inputs_[c].moved[i]);
        if (i < segments_) within_(r, c) += dot(laws_.segment[c][i].lower, inputs_[r].moved[i]);
      }
}

template <class Model>
Slopes<Model>::Row& Slopes<Model>::add_row(int parameter, int input, int obstacle) {
  if (used_ == static_cast<int>(rows_.size())) rows_.emplace_back(segments_, mounts_);
  Row& row = rows_[used_++];
  row.parameter = parameter;
  row.input = input;
  row.obstacle = obstacle;
  row.tensions = {};
  row.gaps.assign(touches_.size(), {});
  row.forces.clear();
  std::fill(row.response.mounts.begin(), row.response.mounts.end(), Position{});
  std::fill_n(row.changes.begin(), held_.count, 0.0);
  if (still_) row.response.clear();
  return row;
}

// A taut cable of a rod changes its own slack and nothing else; a slack one does nothing.
template <class Model>
void Slopes<Model>::add_cable_rows(int contacts, int cables) {
  if constexpr (Model::kRod) {
    for (int j = 0; j < held_.count; ++j)
      if (const int cable = held_.contact[j] - contacts; cable >= 0 && cable < cables) {
        Row& row = add_row(cable, -1, -1);
        row.changes[j] = -1;
        row.response.clear();
      }
  } else {
    for (int k = 0; k < cables; ++k) add_input_row(k, k);
  }
}

template <class Model>
void Slopes<Model>::add_input_row(int parameter, int input) {
  Row& row = add_row(parameter, input, -1);
  std::copy_n(inputs_[input].gaps.begin(), held_.count, row.changes.begin());
  for (int m = 0; m < mounts_; ++m) row.response.mounts[m] -= inputs_[input].mounts[m];
  if constexpr (!Model::kRod)
    for (int c = 0; c < kCables; ++c) row.tensions[c] = within_(c, input);
}

template <class Model>
void Slopes<Model>::add_obstacle_row(const ContactProblem& problem, int obstacle, int motion, int first) {
  Row* row = nullptr;
  for (std::size_t t = 0; t < touches_.size(); ++t) {
    const Touch& touch = touches_[t];
    if (touch.obstacle != obstacle) continue;
    if (!row) row = &add_row(first + kMotions * obstacle + motion, -1, obstacle);
    const GapRate<kSpace> rate = row->gaps[t] = problem.gap_rate(touch.contact, motion, touch.gap);
    if (touch.held >= 0) row->changes[touch.held] = rate.value;
    if (touch.multiplier == 0) continue;
    Position pressed = rate.slope;
    for (double& part : pressed.v) part *= touch.multiplier;
    row->forces.push_back(problem.force(touch.contact, pressed));
    if (touch.mount >= 0) row->response.mounts[touch.mount] -= pressed;
    if constexpr (!Model::kRod)
      for (int c = 0; c < kCables; ++c)
        row->tensions[c] -= dot(pressed, problem.velocity(touch.contact, inputs_[c].moved));
  }
}

template <class Model>
void Slopes<Model>::respond() {
  forcings_.clear();
  if (still_) return;
  for (int k = 0; k < used_; ++k) {
    Row& row = rows_[k];
    if (row.input >= 0)
      forcings_.push_back({inputs_[row.input].gradient.data(), {}, &row.response});
    else if (row.obstacle >= 0)
      forcings_.push_back({nullptr, row.forces, &row.response});
  }
  kkt_.respond(forcings_);
  for (int k = 0; k < used_; ++k) qp_.close(held_.count, rows_[k].changes, rows_[k].response);
}

// Change of the Lagrangian's slope in a cable of the paper's models, with unknowns and multipliers.
template <class Model>
double Slopes<Model>::tension_slope(const Row& row, int cable) const {
  const Input& input = inputs_[cable];
  double slope = row.tensions[cable];
  if (still_) return slope;
  for (int i = 0; i < segments_; ++i) slope += dot(input.gradient[i], row.response.controls[i]);
  for (int m = 0; m < mounts_; ++m) slope += dot(input.mounts[m], row.response.mounts[m]);
  for (int j = 0; j < held_.count; ++j) slope -= input.gaps[j] * row.changes[j];
  return slope;
}

template <class Model>
void Slopes<Model>::finish(const ContactProblem& problem, const Iterate& at, Row& row, double* to) const {
  const bool is_length = row.input == kInputs - 1;
  const int obstacles = static_cast<int>(problem.obstacles().size());
  const SlopeRow<Model> fields(segments_, problem.contacts(), cables_, obstacles);
  double* multipliers = to + fields.nodes + fields.turns;
  double* tensions = multipliers + fields.contacts;
  const double scale = problem.energy_scale();
  for (int j = 0; j < held_.count; ++j) {
    const int contact = held_.contact[j];
    if (contact < problem.contacts()) multipliers[contact] = row.changes[j];
    if (Model::kRod && problem.is_slack(contact)) tensions[contact - problem.contacts()] = scale * row.changes[j];
  }
  if constexpr (!Model::kRod)
    for (int k = 0; k < cables_; ++k) tensions[k] = (at.command.cables[k] < 0 ? -scale : scale) * tension_slope(row, k);
  if (is_length) {  // the energy scale falls as the length grows
    const auto now = problem.tensions(at.active);
    for (int k = 0; k < cables_; ++k) tensions[k] -= now[k] / at.command.length;
  }
  if (row.input >= 0)
    for (int i = 1; i <= segments_; ++i) row.response.states[i] += inputs_[row.input].moved[i];
  for (int i = 1; i <= segments_; ++i)
    for (int k = 0; k < 3; ++k) {
      to[3 * i + k] = row.response.states[i][k];
      if (kSpace == 3) to[fields.nodes + 3 * i + k] = row.response.states[i][Model::kState - 3 + k];
    }
  double* forces = tensions + fields.cables;
  write_forces(problem, row, forces);
  if (is_length)
    for (int j = 0; j < obstacles; ++j) {
      const Position now = problem.contact_force(at.active, j);
      for (int k = 0; k < kSpace; ++k) forces[kSpace * j + k] -= now[k] / at.command.length;
    }
  for (int j = 0; j < obstacles; ++j)
    if (const int mount = problem.mount_of(j); mount >= 0)
      std::copy_n(row.response.mounts[mount].v.begin(), kSpace, forces + fields.forces + kSpace * j);
}

// Slope of the gap of a contact, 0 where it is held.
template <class Model>
double Slopes<Model>::gap_slope(const ContactProblem& problem, int contact, const Row& row) const {
  if (std::count(held_.contact.begin(), held_.contact.begin() + held_.count, contact) > 0) return 0;
  return problem.slope(contact).along(row.response);
}

// Adds how the gap of a contact that is not held changes while its obstacle moves and the robot does not.
template <class Model>
void Slopes<Model>::add_own_motion(const ContactProblem& problem, int contact, double* slopes, int size) const {
  if (std::count(held_.contact.begin(), held_.contact.begin() + held_.count, contact) > 0) return;
  const int first = cables_ + (asked_ == kInputs) + kMotions * (contact / problem.robot().points());
  const Gap<kSpace> gap = problem.gap(contact);
  for (int motion = 0; motion < kMotions; ++motion)
    slopes[(first + motion) * size] += problem.gap_rate(contact, motion, gap).value;
}

template <class Model>
double Slopes<Model>::multiplier_along(int contact, const Vec<Model::kCables>& motion) const {
  double slope = 0;
  for (int j = 0; j < held_.count; ++j)
    for (int k = 0; k < used_; ++k)
      if (held_.contact[j] == contact && rows_[k].parameter < cables_)
        slope += motion[rows_[k].parameter] * rows_[k].changes[j];
  return slope;
}

// The slack of a cable falls with its own displacement.
template <class Model>
double Slopes<Model>::gap_along(const ContactProblem& problem, int contact, const Vec<Model::kCables>& motion) const {
  double slope = problem.is_slack(contact) ? -motion[contact - problem.contacts()] : 0;
  for (int k = 0; k < used_; ++k)
    if (rows_[k].parameter < cables_) slope += motion[rows_[k].parameter] * gap_slope(problem, contact, rows_[k]);
  return slope;
}

template <class Model>
void Slopes<Model>::write_forces(const ContactProblem& problem, const Row& row, double* to) const {
  const double scale = problem.energy_scale();
  for (std::size_t t = 0; t < touches_.size(); ++t) {
    const Touch& touch = touches_[t];
    Position motion = problem.velocity(touch.contact, row.response.states);
    if (touch.mount >= 0) motion -= row.response.mounts[touch.mount];
    Position turn = times(touch.gap.curvature(1), motion);
    turn += row.gaps[t].slope;
    const double change = touch.held >= 0 ? row.changes[touch.held] : 0;
    for (int k = 0; k < kSpace; ++k)
      to[kSpace * touch.obstacle + k] += scale * (change * touch.gap.slope[k] + touch.multiplier * turn[k]);
  }
}

#define CCR_INSTANTIATE(Model) template class Slopes<Model>;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
