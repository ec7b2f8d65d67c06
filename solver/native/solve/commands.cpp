// How commands compare: how far apart they are, and what they ask of the cables.
#include <algorithm>
#include <cmath>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"

namespace ccr {

using namespace tolerances;

// Distance of two commands, in displacements of a cable [a].
template <class Model>
double ModelContinuation<Model>::command_distance(const Command& a, const Command& b) const {
  const Robot& robot = problem_.robot();
  double farthest = 0;
  for (int k = 0; k < kCables; ++k) farthest = std::max(farthest, std::abs(a.cables[k] - b.cables[k]));
  farthest = std::max(farthest / robot.offset, kInsertion * std::abs(a.length - b.length) / robot.max_length);
  farthest = std::max(farthest, kMotion * problem_.obstacle_motion(a.scene, b.scene) / robot.max_length);
  return std::max(farthest, kLoading * std::abs(a.loads - b.loads));
}

// The travel that the trend is a slope in: signed for one cable; several cables move evenly while their trend lasts.
template <class Model>
double ModelContinuation<Model>::travel(const Command& from, const Command& to) const {
  return keeps_trend() ? to.cables[0] - from.cables[0] : command_distance(from, to);
}

// How far a cable is pulled in. A displacement in the paper's model of space pulls one cable of a pair.
template <class Model>
double ModelContinuation<Model>::pull(const Command& command, int cable) const {
  return Model::kRod ? command.cables[cable] : std::abs(command.cables[cable]);
}

// Whether a command pulls a cable in, by more than the rounding of a displacement that is to stay.
template <class Model>
bool ModelContinuation<Model>::pulls_in(const Command& command, int cable) const {
  return pull(command, cable) > pull(present_.command, cable) + kCommandResolution * problem_.robot().offset;
}

template <class Model>
bool ModelContinuation<Model>::pulls_cable(const Command& command) const {
  for (int k = 0; k < kCables; ++k)
    if (pulls_in(command, k)) return true;
  return false;
}

template <class Model>
bool ModelContinuation<Model>::only_releases(const Command& command) const {
  return !pulls_cable(command) && command.length == present_.command.length &&
         command.loads == present_.command.loads && !moves_obstacles(command) && !(command == present_.command);
}

// The command that is gone for: while anything touches, the cables are not slackened below a pretension, where they
// alone give the robot its shape. A slack robot that something meets is pulled to it first.
template <class Model>
ModelContinuation<Model>::Command ModelContinuation<Model>::raise_to_pretension(Command wanted) const {
  const double pretension = kPretension * problem_.robot().offset;
  const bool meets = met_slack_ && (moves_obstacles(wanted) || wanted.length != present_.command.length);
  if (Model::kRod || largest_displacement(wanted.cables) >= pretension) return wanted;
  if (!meets && !problem_.touches_obstacle(present_.active)) return wanted;
  int taut = 0;
  for (int k = 1; k < kCables; ++k)
    if (std::abs(present_.command.cables[k]) > std::abs(present_.command.cables[taut])) taut = k;
  const double present = present_.command.cables[taut];
  const double least = meets ? pretension : std::min(std::abs(present), pretension);
  if (std::abs(wanted.cables[taut]) < least) wanted.cables[taut] = std::copysign(least, present);
  if (!meets || std::abs(present) >= pretension) return wanted;
  Command pulled = present_.command;
  pulled.cables = wanted.cables;
  return pulled;
}

#define CCR_INSTANTIATE(Model)                                                                             \
  template double ModelContinuation<Model>::travel(const Command&, const Command&) const;                  \
  template double ModelContinuation<Model>::pull(const Command&, int) const;                               \
  template bool ModelContinuation<Model>::pulls_in(const Command&, int) const;                             \
  template bool ModelContinuation<Model>::pulls_cable(const Command&) const;                               \
  template bool ModelContinuation<Model>::only_releases(const Command&) const;                             \
  template ModelContinuation<Model>::Command ModelContinuation<Model>::raise_to_pretension(Command) const; \
  template double ModelContinuation<Model>::command_distance(const Command&, const Command&) const;
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
