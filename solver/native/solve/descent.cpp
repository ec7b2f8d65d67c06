// What happens after the end of a branch: the robot descends, feasibly and in small motions, to where it goes.
#include <algorithm>
#include <cmath>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"

namespace ccr {

using namespace tolerances;

// Descends from `present_`, whose branch ends within the smallest step, to a stable equilibrium under a command part of
// the way to this one; back to `present_` where there is none, or where the motor would have to hold too much: several
// motors let their cables out on the way then, and those that keep their tension pull their cables in up to a ceiling.
template <class Model>
ModelContinuation<Model>::End ModelContinuation<Model>::descend_from_end(const Command& command, Command ceiling) {
  const bool loading = command.loads != present_.command.loads;  // what the motors cannot hold then, they let out
  const bool lets_out = Model::kRod && layout_.cables.size == 1 && !pulls_cable(command) &&
                        pull(command, 0) < pull(present_.command, 0);  // whatever the base does
  motors_yield_ = Model::kRod && layout_.cables.size > 1;
  if (!motors_yield_) ceiling.cables.v.fill(HUGE_VAL);
  const bool motor_holds =
      !motors_yield_ && !loading && !lets_out && !only_releases(command) && !moves_obstacles(command);
  const bool held = highest(tensions_) <= problem_.robot().max_tension;  // at the start
  descent_start_ = present_;
  descent_kept_ = problem_.kept_tensions();
  last_yielded_ = -1;
  for (int k = 0; motors_yield_ && k < static_cast<int>(layout_.cables.size); ++k)
    if (problem_.keeps_tension(k) && command.cables[k] < present_.command.cables[k]) hold_length(k);
  if (!bends_evenly_ && !problem_.touches_obstacle(present_.active)) {
    before_contact_ = present_;
    at_contact_ = command;
  }
  descent_points_ = points_;
  descent_mounts_ = mounts_;
  descent_trace_ = recorded();
  present_evaluated_ = false;
  problem_.enable_barrier(true);
  bool moved = newton_.set_metric(present_) && leave_towards(command), folded = false;
  constexpr int kIterations = Model::kRod ? kDescentIterations : kShearingIterations;
  const double least = kFar * kDescentMove * problem_.robot().max_length;
  int far = 0;  // iterates that fill their room, which do not count
  for (int i = 0; i - far < kIterations && moved && !work_is_spent(); ++i) {
    std::swap(present_, trial_);
    const bool held_one = hold_first_beyond(ceiling);
    record_shape();
    if ((held_one || hold_beyond(ceiling)) && !newton_.set_metric(present_)) break;
    const bool finished = i % kFinishEvery == kFinishEvery - 1 && try_newton(ceiling);
    const bool is_long = i >= kLongDescent, fills = is_long && Model::kRod;
    const bool ended =
        finished || descend_once(is_long && !fills ? kDescentStride : kDescentCap, fills, ceiling, moved);
    far += fills && !ended && moved && largest_motion() >= least;
    folded = !finished && problem_.in_barrier();
    if (!ended) continue;
    if (folded && !try_newton(ceiling)) break;
    if (hold_beyond(ceiling) || yield_at_limit(ceiling)) {
      trial_ = present_;
      moved = newton_.set_metric(present_);
      continue;
    }
    return finish_descent(motor_holds, held);
  }
  result_.reason = work_is_spent() ? Reason::kWork : folded ? Reason::kFolded : Reason::kStuck;
  return undo_descent(End::kStuck);
}

// The energy at the shape at which the problem is evaluated, with that of motors which keep their tension up to a
// ceiling, beyond which their cables are slack [rad²].
template <class Model>
double ModelContinuation<Model>::energy_below(const Command& ceiling) const {
  double energy = problem_.energy();
  for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k)
    if (problem_.keeps_tension(k))
      energy += problem_.kept_multiplier(k) * std::max(problem_.taken(k), ceiling.cables[k]);
  return energy;
}

// Lets motors hold their cables at an iterate of a descent, `present_`, that keep their tension, and whose cables have
// come in beyond a ceiling: they are slack there, or soon taut again. False where there are none.
template <class Model>
bool ModelContinuation<Model>::hold_beyond(const Command& ceiling) {
  bool holds = false;
  if constexpr (Model::kRod)
    for (int k = cable_beyond(ceiling); k >= 0; k = cable_beyond(ceiling)) {
      problem_.keep_tension(k, HUGE_VAL);
      present_.command.cables[k] = ceiling.cables[k];
      holds = true;
    }
  return holds;
}

// Where several of these cables have come in beyond a ceiling since the iterate before, `trial_`: goes from that only
// as far as the one that gets there first, and lets its motor hold it. All of them together might lock the robot. False
// where no more than one has, or where that leads nowhere.
template <class Model>
bool ModelContinuation<Model>::hold_first_beyond(const Command& ceiling) {
  if constexpr (Model::kRod) {
    Tensions beyond{};
    const auto excess = [&](int k) { return problem_.taken(k) - ceiling.cables[k]; };
    for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k)
      if (problem_.keeps_tension(k) && excess(k) > follow_tolerance()) beyond[k] = excess(k);
    if (std::count_if(beyond.v.begin(), beyond.v.end(), [](double by) { return by > 0; }) < 2) return false;
    back_ = present_;
    present_ = trial_;
    problem_.evaluate(present_);
    int first = 0;
    double least = HUGE_VAL;  // room before the ceiling, over what was gone beyond it
    for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k)
      if (beyond[k] > 0 && -excess(k) < least * beyond[k]) {
        least = -excess(k) / beyond[k];
        first = k;
      }
    const double kept = problem_.kept_tensions()[first];
    Command held = present_.command;
    held.cables[first] = ceiling.cables[first];
    problem_.keep_tension(first, HUGE_VAL);
    const bool leads_on = newton_.set_metric(present_) && restore_at(held, true);
    present_ = leads_on ? trial_ : back_;
    if (!leads_on) problem_.keep_tension(first, kept);
    problem_.evaluate(present_);
    return leads_on;
  }
  return false;
}

// Lets the motor keep the limit at the end of a descent, `present_`, that would have to hold most beyond it, up to
// where its cable is: one by one, as those that pull against each other relieve each other. Where it comes to the same
// shape again, because those that were let out have come in as far as they may, only the last one is let out. The
// tensions of an iterate that is no equilibrium, where steps are damped, mean nothing. False where there is none.
template <class Model>
bool ModelContinuation<Model>::yield_at_limit(Command& ceiling) {
  if constexpr (Model::kRod) {
    ActiveSet& active = present_.active;
    double most = problem_.robot().max_tension / problem_.energy_scale();
    int place = -1;
    for (int j = 0; j < active.count && motors_yield_; ++j) {
      const int contact = active.contact[j];
      if (!problem_.is_slack(contact) || active.multiplier[j] <= most || let_out_[contact - problem_.contacts()])
        continue;
      most = contact - problem_.contacts() == last_yielded_ ? HUGE_VAL : active.multiplier[j];
      place = j;
    }
    if (place < 0) return false;
    const int cable = active.contact[place] - problem_.contacts();
    last_yielded_ = cable;
    ceiling.cables[cable] = present_.command.cables[cable];
    problem_.keep_tension(cable, below_limit());
    active.drop(place);
    return true;
  }
  return false;
}

template <class Model>
ModelContinuation<Model>::End ModelContinuation<Model>::finish_descent(bool motor_holds, bool held) {
  problem_.enable_barrier(false);
  present_evaluated_ = false;
  clear_trend();
  evaluate_present();
  if (problem_.is_moving() && pushes(tensions_)) {
    result_.reason = Reason::kStuck;
    return undo_descent(End::kStuck);
  }
  const bool unwinds = (motor_holds || motors_yield_) && problem_.keeps_tensions() && unwound_cable() >= 0;
  if (highest(tensions_) > problem_.robot().max_tension || unwinds) {
    if (motor_holds || unwinds) {
      over_limit_ = tensions_;
      return undo_descent(End::kOverTension);
    }
    if (held) keep_last_held(descent_start_, descent_kept_, descent_trace_);
  }
  if (problem_.keeps_tensions()) follow_lengths(present_.command);
  double farthest = 0;
  for (std::size_t k = 0; k < points_.size(); ++k)
    farthest = std::max(farthest, norm(minus(points_[k], descent_points_[k])));
  return farthest > kStill * problem_.robot().max_length ? End::kSnapped : End::kPassed;
}

template <class Model>
ModelContinuation<Model>::End ModelContinuation<Model>::undo_descent(End end) {
  problem_.enable_barrier(false);
  if constexpr (Model::kRod)
    for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k)
      if (problem_.kept_tensions()[k] != descent_kept_[k]) problem_.keep_tension(k, descent_kept_[k]);
  present_ = descent_start_;
  points_ = descent_points_;
  mounts_ = descent_mounts_;
  if (shapes_) shapes_->resize(descent_trace_);
  present_evaluated_ = false;
  evaluate_present();
  return end;
}

// Leaves in `trial_` a feasible shape under a command at least kSmallestPart of the way to this one.
template <class Model>
bool ModelContinuation<Model>::leave_towards(const Command& command) {
  for (double part = 1; part >= kSmallestPart; part /= 8) {
    const Command nearer = between(present_.command, command, part);
    if (restore_at(nearer, true) || restore_at(nearer, false) || buckle_at(nearer)) return true;
  }
  return change_sides(command);
}

// Leaves in `trial_` the equilibrium nearby under a command that pulls the other cable of a pair in eq. 13: however
// little is pulled, these cables give a robot in contact another shape, which no small motion leads to.
template <class Model>
bool ModelContinuation<Model>::change_sides(const Command& command) {
  if constexpr (Model::kRod || kSpace == 2) return false;
  bool changes = false;
  for (int k = 0; k < kCables; ++k)
    changes |= std::signbit(present_.command.cables[k]) != std::signbit(command.cables[k]);
  if (!changes) return false;
  trial_ = present_;
  trial_.command = command;
  const NewtonResult found = newton_.solve(trial_, kDampedIterations);
  result_.iterations += found.iterations;
  return found.converged && trial_is_close();
}

// Leaves in `trial_` the feasible shape closest to `present_` under a command, with the active gaps held closed or not.
template <class Model>
bool ModelContinuation<Model>::restore_at(const Command& command, bool holding) {
  trial_ = present_;
  trial_.command = command;
  if (!holding) trial_.active.count = 0;
  return newton_.restore(trial_) && trial_is_close();
}

// The same where to first order no motion satisfies all gaps, as where cables that pull against each other are too
// tight for segments in line: bends the robot out of its shape to where some motion does.
template <class Model>
bool ModelContinuation<Model>::buckle_at(const Command& command) {
  ActiveSet held = newton_.conflict();
  if (!holds_cables(held)) return false;
  held.count -= 1;  // the slope of the last depends on those of the others
  double size = kDescentCap;
  for (int attempt = 0; attempt < kBucklings; ++attempt, size /= -2) {
    trial_ = present_;
    trial_.command = command;
    if (!newton_.bend_softly(trial_, held, size)) return false;
    trial_.active.count = 0;
    if (newton_.restore(trial_) && trial_is_close()) return true;
  }
  return false;
}

// One iterate of the descent from `present_` to `trial_`, of at most a size, shortened until nothing is jumped over,
// and no cable comes in so far beyond its ceiling that energy is gained; by the step of a definite Hessian where that
// of the present one leads nowhere. Where it is to fill its room, one that moved too far is first shortened to just
// that. True at an equilibrium.
template <class Model>
bool ModelContinuation<Model>::descend_once(double cap, bool fills, const Command& ceiling, bool& moved) {
  moved = false;
  if (is_interrupted() || !problem_.evaluate(present_)) return false;
  const double before = energy_below(ceiling);
  int attempts = kDescentShortenings;
  for (int attempt = 1; attempt <= attempts; ++attempt) {
    trial_ = present_;
    ++result_.iterations;
    NewtonResult found = newton_.descend_once(trial_, cap, false);
    if (!found.moved && !found.converged && !problem_.in_barrier()) {
      trial_ = present_;
      found = newton_.descend_once(trial_, cap, true);
    }
    moved = found.moved;
    if (found.converged) return true;
    if (!moved) return false;
    const bool shortest = attempt == attempts;
    if (trial_is_close() && (shortest || cable_beyond(ceiling) < 0 || energy_below(ceiling) < before)) return false;
    const double room = fills && attempt == 1 ? kDescentMove * problem_.robot().max_length / largest_motion() : 1.0;
    attempts += room < 1;
    cap *= room < 1 ? std::max(kFilled * room, 0.25) : 0.25;
  }
  moved = false;
  return false;
}

// The quadratic end of a descent: true where Newton's method stays close and loses energy.
template <class Model>
bool ModelContinuation<Model>::try_newton(const Command& ceiling) {
  const double energy = problem_.energy();
  trial_ = present_;
  problem_.enable_barrier(false);
  const NewtonResult found = newton_.solve(trial_, 0);
  problem_.enable_barrier(true);
  result_.iterations += found.iterations;
  if (!found.converged || problem_.energy() > energy || cable_beyond(ceiling) >= 0 || !trial_is_close()) return false;
  std::swap(present_, trial_);
  record_shape();
  return true;
}

// Whether an iterate of the descent is near the last one, and nothing was passed through on the way.
template <class Model>
bool ModelContinuation<Model>::trial_is_close() const {
  const double moved = largest_motion();
  return moved <= kDescentMove * problem_.robot().max_length && passage_is_clear(moved);
}

#define CCR_INSTANTIATE(Model) \
  template ModelContinuation<Model>::End ModelContinuation<Model>::descend_from_end(const Command&, Command);
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
