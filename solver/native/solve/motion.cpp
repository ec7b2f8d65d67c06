// Obstacles that move within a step: how far they have gone is a parameter of the continuation, as the cables are.
#include <algorithm>
#include <cmath>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"

namespace ccr {

using namespace tolerances;

namespace {

// Part of the way from one number to another, both ends exact; they may be infinite and equal.
double mix(double from, double to, double part) {
  if (part == 1 || from == to) return to;
  return from + part * (to - from);
}

template <std::size_t N>
void mix(const std::array<double, N>& from, const std::array<double, N>& to, double part, std::array<double, N>& out) {
  for (std::size_t k = 0; k < N; ++k) out[k] = mix(from[k], to[k], part);
}

}  // namespace

template <class Model>
void ContactProblem<Model>::move_obstacles(std::span<const Obstacle> towards, std::span<const double> motions) {
  evaluated_ = false;
  origins_ = obstacles_;
  towards_ = towards;
  motions_ = motions;
  largest_motion_ = *std::max_element(motions.begin(), motions.end());
  passing_.assign(origins_.begin(), origins_.end());
  obstacles_ = passing_;
  part_ = 0;
}

// Puts the obstacles part of their way, with all that is known of their shapes in proportion.
template <class Model>
void ContactProblem<Model>::place_obstacles(double part) {
  if (part == part_) return;
  part_ = part;
  for (std::size_t j = 0; j < passing_.size(); ++j) {
    const Obstacle &from = origins_[j], &to = towards_[j];
    Obstacle& now = passing_[j];
    mix(from.parameters, to.parameters, part, now.parameters);
    mix(from.center.v, to.center.v, part, now.center.v);
    now.radius = mix(from.radius, to.radius, part);
    now.min_curvature_radius = mix(from.min_curvature_radius, to.min_curvature_radius, part);
    now.inradius = mix(from.inradius, to.inradius, part);
    for (std::size_t k = 0; k < now.outline.size(); ++k)
      mix(from.outline[k].v, to.outline[k].v, part, now.outline[k].v);
  }
}

template <class Model>
ContactProblem<Model>::Position ContactProblem<Model>::displacement(int obstacle, double from, double to) const {
  Position moved{};
  if (!is_moving()) return moved;
  for (int k = 0; k < kSpace; ++k)
    moved[k] = (to - from) * (towards_[obstacle].center[k] - origins_[obstacle].center[k]);
  return moved;
}

template <class Model>
StepResult ModelContinuation<Model>::move(const double* from, const double* target,
                                          std::span<const Obstacle<kSpace>> towards, std::span<const double> motions,
                                          double* to, const StepSlopes& slopes) {
  const auto origins = problem_.obstacles();
  if (std::any_of(motions.begin(), motions.end(), [](double moved) { return moved > 0; }))
    problem_.move_obstacles(towards, motions);
  StepResult result = follow(from, target, to, slopes);
  if (result.scene < 1) result.status = std::max(result.status, Status::kBlocked);
  set_obstacles(origins);
  return result;
}

// Lets obstacles wait until the motors hold, and a cable that is held at its limit until they are where they go: the
// way there is not one of proportional rates then.
template <class Model>
void ModelContinuation<Model>::share_motion(Command& goal, bool holds) const {
  if (highest(tensions_) > problem_.robot().max_tension)
    goal.scene = present_.command.scene;
  else if (layout_.cables.size == 1 && (holds || is_at_tension_limit()) && pulls_cable(goal))
    goal.cables = present_.command.cables;
}

// Where obstacles on their way to a command press so much that the motor cannot hold the only cable: lets it out until
// it is held at the limit. `trial_` is the equilibrium under the command. False where letting out does not help.
template <class Model>
bool ModelContinuation<Model>::pay_out(const Command& command) {
  const Robot& robot = problem_.robot();
  const double least = Model::kRod ? robot.rod.least_pull : kPretension * robot.offset;
  const double compliance = robot.offset * robot.offset * robot.max_length / robot.rigidity;  // of a free robot [mm/N]
  Command above = command, below = command;
  Tensions tensions = trial_tensions_;
  double out = 0;
  for (int i = 0; i < kStallIterations; ++i) {
    const double pulled = above.cables[0] - present_.command.cables[0];
    const double needed = compliance * (highest(tensions) - robot.max_tension) + kCommandResolution * robot.offset;
    out = pulled > 0 ? pulled : std::max(2 * out, needed);
    below.cables[0] = std::max(above.cables[0] - out, least);
    if (!(below.cables[0] < above.cables[0])) return false;
    const Move move = try_command(below);
    if (move == Move::kRejected) return false;
    if (move == Move::kAccepted) {
      accept();
      trial_.command = above;
      trial_tensions_ = tensions;
      approach_tension_limit();
      return true;
    }
    above = below;
    tensions = trial_tensions_;
  }
  return false;
}

// Whether the cable of the paper's model, which knows none that is slack, would have to push.
template <class Model>
bool ModelContinuation<Model>::pushes(const Tensions& tensions) const {
  const Robot& robot = problem_.robot();
  return !Model::kRod && kSpace == 2 && tensions[0] < -kPush * robot.rigidity / (robot.offset * robot.max_length);
}

#define CCR_INSTANTIATE(Model)                                                                                        \
  template void ContactProblem<Model>::move_obstacles(std::span<const Obstacle>, std::span<const double>);            \
  template void ContactProblem<Model>::place_obstacles(double);                                                       \
  template ContactProblem<Model>::Position ContactProblem<Model>::displacement(int, double, double) const;            \
  template StepResult ModelContinuation<Model>::move(const double*, const double*, std::span<const Obstacle<kSpace>>, \
                                                     std::span<const double>, double*, const StepSlopes&);            \
  template void ModelContinuation<Model>::share_motion(Command&, bool) const;                                         \
  template bool ModelContinuation<Model>::pushes(const Tensions&) const;                                              \
  template bool ModelContinuation<Model>::pay_out(const Command&);
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
