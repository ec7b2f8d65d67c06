// An equilibrium followed from command to command, as the robot would move.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "solve/newton.hpp"

namespace ccr {

// How a step ended; of several, the last one.
enum class Status { kConverged, kSnapped, kStalled, kBlocked, kGaveUp };

// Why a step was given up: a descent led to where a segment folds over, the work of a step was spent, or a descent could
// not go on.
enum class Reason { kNone, kFolded, kWork, kStuck };

// How far an equilibrium is from meeting its conditions, without units: the largest slope of the Lagrangian in a control
// [rad²], the largest gap that is violated, or open and active, over the robot's length, and the largest product of a
// multiplier and its gap [rad²].
struct Optimality {
  double stationarity = 0, gap = 0, complementarity = 0;
};

// What is the same for all models of a robot in the plane or in space.
template <int D>
class Follower {
 public:
  virtual ~Follower() = default;

  // An equilibrium as one block of numbers, in this order: cables, length, tensions, objective; coordinates of each
  // segment; x, y, angle or x, y, z of each node; frame of each node, the direction of the cable or a rotation matrix;
  // multiplier of each contact; gap of each contact; displacement of each obstacle; force of each obstacle on the robot;
  // force of all of them; smallest gap; tensions where the present contact began,
  // signed as the displacements, 0 without one; slopes of the free tip; 1
  // for each point that touches, else 0; and with one cable the trend of the coordinates, of the displacements, and of the
  // multipliers of the active contacts in the order of the contacts.
  virtual std::size_t block_size() const = 0;

  // Goes among other obstacles, as many as before, which must stay where they are.
  virtual void enter(std::span<const Obstacle<D>> obstacles) = 0;

  // Takes the robot from the equilibrium in one block towards the `target`, cables and length evenly, and writes the one
  // reached to another.
  virtual Status follow(const double* from, const double* target, double* to) = 0;

  // Whether steady pulls from rest, of this increment along a direction and to less than this limit, reach a contact force
  // on one of the obstacles, or with -1 on all together, without an event on the way; false as well when the robot at rest
  // is not clear of them. Writes the force reached last to `reached`.
  virtual bool reaches(double force, int obstacle, const double* direction, double increment, double limit, double length,
                       double* reached) = 0;

  // How well the equilibrium in a block meets its conditions, computed anew from its coordinates and multipliers.
  virtual Optimality optimality(const double* block) = 0;

  int iterations = 0;      // of Newton's method in the last follow
  Reason reason = Reason::kNone;  // why it gave up
  int factorizations = 0;  // of its Hessian
  // When set, receives of every accepted shape the three numbers of every node, the points that can touch, and the
  // displacements of the obstacles.
  std::vector<double>* trace = nullptr;
};

// How an equilibrium has changed along the way of the command, to start the search for the next one; zero where it is free, or
// a contact came or went.
template <class Model>
struct Trend {
  std::vector<typename Model::Control> controls;
  std::vector<Position<Model::kSpace>> mounts;
  std::array<double, tolerances::kMaxActive> multipliers{};  // in the order of the active set
};

// The follower for a robot, for scenes of this many obstacles.
template <int D>
std::unique_ptr<Follower<D>> make_follower(const Robot& robot, int obstacles);

template <class Model>
class Branch : public Follower<Model::kSpace> {
 public:
  static constexpr int kSpace = Model::kSpace, kCables = Model::kCables;
  static constexpr bool kTrend = kCables == 1;  // whether the trend of a step is kept for the next
  using Chain = ccr::Chain<Model>;
  using Position = ccr::Position<kSpace>;
  using Command = ccr::Command<kCables>;
  using Iterate = ccr::Iterate<Model>;
  using Frame = typename Model::Frame;
  using Tensions = Vec<kCables>;

  using Follower<kSpace>::iterations;
  using Follower<kSpace>::factorizations;
  using Follower<kSpace>::reason;
  using Follower<kSpace>::trace;

  Branch(const Robot& robot, int obstacles);

  std::size_t block_size() const override;
  void enter(std::span<const Obstacle<kSpace>> obstacles) override;
  Status follow(const double* from, const double* target, double* to) override;
  bool reaches(double force, int obstacle, const double* direction, double increment, double limit, double length,
               double* reached) override;
  Optimality optimality(const double* block) override;

 private:
  enum class Move { kAccepted, kRejected, kOverTension };
  enum class End { kPassed, kSnapped, kStuck, kOverTension };

  void load(const double* block);
  void store(double* block);
  Tensions first_tensions(const Command& start);
  Status follow(const Command& target);
  Command goal(Command wanted) const;
  bool hold(Command& wanted) const;
  bool yield(Command& wanted, double least) const;
  bool unyielding() const;
  bool barred(const Command& command);
  bool tight() const;
  double apart(const Command& a, const Command& b) const;
  double travelled(const Command& from, const Command& to) const;
  bool spent() const { return newton_.work() - work_before_ > tolerances::kWork; }
  Move attempt(const Command& command);
  double lost(const Command& command) const;
  bool jumped(const Command& command, double moved);
  bool returns();
  bool meets_narrow() const;
  bool attempt_free();
  bool approach_limit();
  bool at_limit() const;
  bool pulls(const Command& command) const;
  bool releases(const Command& command) const;
  End pass_end(const Command& command);
  bool finish();
  bool depart(const Command& command, bool holding);
  bool leave(const Command& command);
  bool descend(bool& moved);
  double farthest() const;
  bool close_by() const;
  bool passable(double moved) const;
  bool unswept(int obstacle, double moved) const;
  void accept();
  void hold_last(const Iterate& held);
  void learn();
  void forget();
  void predict();
  void remember();
  void settle();

  Newton<Model> newton_;
  Iterate present_, trial_;
  Trend<Model> trend_;  // of `present_`
  Iterate back_;          // scratch of `returns`
  Iterate held_;          // the last equilibrium of the step that the motors held, where a later one was not
  bool exceeded_ = false; // whether there is one
  Iterate start_;         // of a descent, and its points and mounts
  std::vector<Position> start_points_, start_mounts_;
  std::vector<typename Model::Control> predicted_;  // controls of `trial_` along the trend
  bool steady_ = false;   // whether there is a trend
  std::int64_t work_before_ = 0;  // the step began
  double energy_ = 0;     // at `present_`
  Tensions tensions_{}, trial_tensions_{};
  Tensions onset_{};      // tensions where the present contact began
  bool touched_ = false;  // at the start
  std::vector<Position> nodes_;  // of the block last read
  std::vector<Frame> frames_;
  std::vector<Position> points_, mounts_;  // of the last accepted shape
  bool settled_ = false;                  // whether the chain is evaluated at `present_`
};

}  // namespace ccr
