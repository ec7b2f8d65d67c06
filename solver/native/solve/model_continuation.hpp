// The continuation compiled for one model. Its files: block_io (blocks read and written), model_continuation (a branch
// followed), commands (how they compare), trend (how it goes on), rest (where it begins), acceptance (whether a shape
// continues the branch), passage (whether the robot passed through an obstacle), motion (obstacles that move),
// tension_limit (stalls and yielding motors), kept_tension (motors at their limit while others go on), conflict (cables
// that pull against each other), descent (what happens after the end of a branch), ramp (whether a pull reaches a
// force), derivatives (slopes in the parameters).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "solve/continuation.hpp"
#include "solve/newton.hpp"
#include "solve/slopes.hpp"

namespace ccr {

// Change of the equilibrium per unit of travel of the command, from which the search for the next one starts. Zero for
// a free robot, and after a contact came or went.
template <class Model>
struct Trend {
  std::vector<typename Model::Control> controls;
  std::vector<Position<Model::kSpace>> mounts;
  std::array<double, tolerances::kMaxTrend> multipliers{};  // in the order of the active set
};

template <class Model>
class ModelContinuation : public Continuation<Model::kSpace> {
 public:
  static constexpr int kSpace = Model::kSpace, kCables = Model::kCables;
  using ContactProblem = ccr::ContactProblem<Model>;
  using Position = ccr::Position<kSpace>;
  using Command = ccr::Command<kCables>;
  using Iterate = ccr::Iterate<Model>;
  using Control = typename Model::Control;
  using Frame = typename Model::Frame;
  using Tensions = Vec<kCables>;
  using Interruption = typename Continuation<kSpace>::Interruption;

  ModelContinuation(const Robot& robot, int obstacles);
  ModelContinuation(const ModelContinuation&) = delete;

  const BlockLayout& layout() const override { return layout_; }
  void set_robot(const Robot& robot) override;
  void set_obstacles(std::span<const Obstacle<kSpace>> obstacles) override;
  void set_interruption(Interruption interruption) override { interruption_ = std::move(interruption); }
  StepResult rest(double length, double* to) override;
  StepResult follow(const double* from, const double* target, double* to, const StepSlopes& slopes) override;
  StepResult move(const double* from, const double* target, std::span<const Obstacle<kSpace>> towards,
                  std::span<const double> motions, double* to, const StepSlopes& slopes) override;
  StepResult trace(const double* from, const double* target, double* to, std::vector<double>& shapes) override;
  bool ramp_reaches_force(const Ramp& ramp, double* reached) override;
  Optimality optimality(const double* block) override;
  void tip_slopes(const double* command, double* to) override;
  int slope_row() const override;
  int parameters() const override;
  SlopeResult slopes(const double* block, const bool* held, bool in_obstacles, double* to) override;

 private:
  enum class Move { kAccepted, kRejected, kOverTension, kPushing };
  enum class Conflict { kNone, kTight, kBlocked };
  enum class End { kPassed, kSnapped, kStuck, kOverTension };

  // How a command is pursued: the sub-step to try next, and what has happened so far.
  struct Pursuit;

  // Block I/O.
  void read_block(const double* block);
  void read_active_set(const double* block);
  void read_mounts(const double* displacements, std::vector<Position>& mounts) const;
  void write_block(double* block);
  void write_forces(double* block) const;
  void write_active_set(double* block) const;
  void write_trend(double* block) const;
  void write_mounts(const std::vector<Position>& mounts, double* displacements) const;

  // Following a branch.
  Status pursue(const Command& target);
  Status pursue(Pursuit& pursuit);
  bool is_met(const Command& target, Status status);
  bool resume(Pursuit& pursuit);
  bool advance(Pursuit& pursuit, const Command& goal, double remaining);
  bool give_way(Pursuit& pursuit, const Command& next, double size, bool pushing);
  bool refine(Pursuit& pursuit, double size, bool blocked);
  Command raise_to_pretension(Command wanted) const;
  Move try_command(const Command& command);
  void accept();
  void record_shape();
  void update_trend();
  void clear_trend();
  void extrapolate_trial();
  void evaluate_present();
  void keep_before_contact(const Iterate& next);
  bool is_clear_at(const Command& start, double part);
  Tensions first_tensions(const Command& start);
  bool keeps_trend() const { return layout_.trend_coordinates.size > 0; }  // in the block, for the next step
  StepResult finish(const Command& start, double* to);
  double pull(const Command& command, int cable) const;
  double command_distance(const Command& a, const Command& b) const;
  double travel(const Command& from, const Command& to) const;
  bool pulls_in(const Command& command, int cable) const;
  bool pulls_cable(const Command& command) const;
  bool only_releases(const Command& command) const;
  bool moves_obstacles(const Command& command) const { return command.scene != present_.command.scene; }
  bool moves_base(const Command& command) const { return command.length != present_.command.length; }
  bool work_is_spent() const {
    return result_.interrupted || newton_.factorizations() - factorizations_before_ > tolerances::kWork;
  }
  // Asks whether to give up, at intervals that take a small part of a second. A step that gives up ends as one that has
  // spent its work.
  bool is_interrupted() {
    unpolled_ += points_.size();
    if (unpolled_ >= tolerances::kPollPoints) {
      unpolled_ = 0;
      if (!result_.interrupted && interruption_) result_.interrupted = interruption_();
    }
    return result_.interrupted;
  }

  // Whether a shape continues the branch.
  bool try_free_shape();
  bool bend_freely();
  bool rests_at(Iterate& one);
  bool bend_segment(Iterate& one);
  bool meets_another_side() const;
  bool was_faced(int contact) const;
  double energy_loss(const Command& command) const;
  bool left_branch(const Command& command, double moved, double loss);
  bool follows_trend() const;
  bool way_back_returns();

  // Whether the robot passed through an obstacle.
  double largest_motion() const;
  bool passage_is_clear(double moved) const;
  bool passage_is_clear(int obstacle, double moved) const;

  // The tension limit.
  bool is_at_tension_limit() const;
  bool is_tight() const;
  bool gap_closed() const;
  bool peaks_at_limit(const Command& goal, double remaining);
  bool stalls_at_once(const Command& goal, double remaining);
  bool approach_tension_limit();
  void share_motion(Command& goal, bool holds) const;
  bool pushes(const Tensions& tensions) const;
  bool pay_out(const Command& command);
  bool hold_stalled_cables(Command& wanted) const;
  bool yield_cables(Command& wanted, double least) const;
  void stop_yielding(const Command& target, Command& wanted) const;
  void wait_for_motors(Command& goal) const;
  bool is_unyielding() const;
  bool is_blocked(const Command& command);
  bool closes(const ActiveSet& holding, const Command& command);
  bool find_holding_set(const Command& command, ActiveSet& holding);
  std::size_t recorded() const { return shapes_ ? shapes_->size() : 0; }
  void keep_last_held(const Iterate& held, const Tensions& kept, std::size_t recorded);

  // Motors at the limit that keep their tension.
  double highest_held(const Tensions& tensions) const;
  bool stop_holding(const Command& wanted);
  template <class Which>
  bool keep_tensions(const Which& which);
  bool keep_tensions_at_limit(const Tensions& over);
  bool keep_tensions_that_jump();
  bool raise_to_limit(const Command& wanted);
  bool raise_kept_tensions(const Command& target);
  bool raise_tension(int cable, double aim, double ceiling);
  void keep_tension(int cable);
  double below_limit() const;
  void hold_length(int cable);
  void hold_lengths(const Command& target);
  double follow_tolerance() const;
  bool pass_with_limit(const Command& target);
  void add_tension(int cable, double multiplier, ActiveSet& active) const;
  void follow_lengths(Command& command) const;
  void leave_kept(Command& goal) const;
  Command ceiling(const Command& wanted, const Command& goal, double part) const;
  int unwound_cable() const;
  int cable_beyond(const Command& ceiling) const;
  bool exceeds_limit_beside(const std::array<int, kMaxCables>& some, int count) const;
  Move try_below(const Command& ceiling, Command command);

  // Gaps that no motion satisfies together.
  Conflict meet_conflict(const Command& command);
  int widest_gap(const ActiveSet& conflict) const;
  bool holds_cables(const ActiveSet& conflict) const;
  bool close_gap(const Command& command, int contact);
  bool raise_tensions(const ActiveSet& conflict);

  // The descent after the end of a branch.
  End descend_from_end(const Command& command, Command ceiling);
  bool hold_beyond(const Command& ceiling);
  bool hold_first_beyond(const Command& ceiling);
  bool yield_at_limit(Command& ceiling);
  End finish_descent(bool motor_holds, bool held);
  End undo_descent(End end);
  bool leave_towards(const Command& command);
  bool change_sides(const Command& command);
  bool restore_at(const Command& command, bool holding);
  bool buckle_at(const Command& command);
  bool descend_once(double cap, bool fills, const Command& ceiling, bool& moved);
  bool try_newton(const Command& ceiling);
  double energy_below(const Command& ceiling) const;
  bool trial_is_close() const;

  // Slopes in the parameters.
  Slopes<Model>& prepare_slopes();
  bool find_held(const bool* held, ActiveSet& gaps) const;
  bool differentiate_step(const Command& start, const Command& target, const double* block, const StepSlopes& to);
  bool differentiate_towards(const Tensions& motion, const SlopeRequest& request, double* rows);
  void find_loose(ActiveSet& held, ActiveSet& loose) const;
  int misjudged(const ActiveSet& held, const ActiveSet& loose, const Tensions& motion) const;

  BlockLayout layout_;
  Newton<Model> newton_;
  ContactProblem& problem_ = newton_.problem;
  bool bends_evenly_;  // whether all segments do where nothing touches,
  Robot one_;          // as this robot of one segment does,
  Newton<Model> segment_;
  Iterate even_;  // of this shape
  Iterate present_, trial_;
  Trend<Model> trend_;  // at `present_`
  double energy_ = 0;   // of `present_`
  Tensions tensions_{}, trial_tensions_{};
  std::array<bool, kCables> let_out_{};  // whether a motor at its limit was found to have no more to let out
  Tensions over_limit_{};                // of the last shape of this step that the motors could not hold
  std::array<int, kMaxCables> jumps_{};  // of each tension over the limit, in this step
  bool present_evaluated_ = false;       // whether the contact problem is evaluated at `present_`

  StepResult result_;  // of the step under way
  Interruption interruption_;
  std::size_t unpolled_ = 0;                // points that were moved since it was asked last
  std::vector<double>* shapes_ = nullptr;   // receives the accepted shapes of a trace
  std::int64_t factorizations_before_ = 0;  // of the step
  Tensions onset_{};                        // tensions where the present contact began
  bool began_in_contact_ = false;           // whether an obstacle was touched where the step began
  Iterate before_contact_;                  // the last equilibrium of the step that touched nothing,
  Command at_contact_{};                    // and a command under which the robot touches
  Iterate last_held_;                // the last equilibrium of the step that the motors held, where a later one was not
  std::size_t last_held_trace_ = 0;  // shapes recorded then
  bool was_exceeded_ = false;        // whether there is one
  bool met_slack_ = false;           // whether something met the robot of the paper's model while its cables were slack

  std::vector<Position> nodes_;  // of the block last read
  std::vector<Frame> frames_;
  std::vector<Position> points_, mounts_;  // of the last accepted shape
  std::vector<Control> predicted_;         // controls of `trial_` along the trend
  bool has_trend_ = false;
  Iterate back_;                   // scratch of `way_back_returns`
  std::vector<Control> unloaded_;  // scratch of `is_blocked`: slope of the energy alone
  Iterate locked_;                 // where cables lock the robot, to first order
  Iterate descent_start_;          // where a descent began, and its points, mounts and recorded shapes
  std::vector<Position> descent_points_, descent_mounts_;
  std::size_t descent_trace_ = 0;
  bool motors_yield_ = false;  // whether those that would have to hold more than the limit let their cables out on it
  Tensions descent_kept_{};    // tensions that motors kept there
  int last_yielded_ = -1;      // the cable that a motor let out last on it
  std::vector<std::unique_ptr<Slopes<Model>>> slopes_;  // for each number of mounts, made when slopes are asked for
};

// The largest of some numbers.
template <int C>
double highest(const Vec<C>& values) {
  return *std::max_element(values.v.begin(), values.v.end());
}

// The command a fraction t of the way from one to another.
template <int C>
Command<C> between(const Command<C>& a, const Command<C>& b, double t) {
  Command<C> out;
  for (int k = 0; k < C; ++k) out.cables[k] = a.cables[k] + t * (b.cables[k] - a.cables[k]);
  out.length = a.length + t * (b.length - a.length);
  out.loads = a.loads + t * (b.loads - a.loads);
  out.scene = a.scene + t * (b.scene - a.scene);
  return out;
}

// Largest displacement of a cable, in size [mm].
template <int C>
double largest_displacement(const Vec<C>& cables) {
  double largest = 0;
  for (const double cable : cables.v) largest = std::max(largest, std::abs(cable));
  return largest;
}

}  // namespace ccr
