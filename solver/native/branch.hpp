// An equilibrium followed from command to command, as the robot would move.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "newton.hpp"

namespace ccr {

enum class Status { kConverged, kSnapped, kStalled, kJammed, kFailed };

// What is the same for all models of a robot.
class Follower {
 public:
  virtual ~Follower() = default;

  // An equilibrium as one block of numbers, in this order: cable, length, tension, objective; coordinate of each
  // segment; x, y, angle of each node; x, y of each cable point; multiplier of each contact; gap of each contact;
  // displacement x, y of each obstacle; force x, y of each obstacle on the robot; force x, y of all of them; smallest
  // gap; tension where the present contact began, 0 without one; slopes of the free tip's x, y, angle; 1 for each point
  // that touches, else 0; trend of the coordinates, of the displacements, and of the multipliers of the active contacts in
  // the order of the contacts.
  virtual std::size_t block_size() const = 0;

  // Goes among other obstacles, as many as before, which must stay where they are.
  virtual void enter(std::span<const Obstacle> obstacles) = 0;

  // Takes the robot from the equilibrium in one block towards `target`, cable and length evenly, and writes the one
  // reached to another.
  virtual Status follow(const double* from, const Command& target, double* to) = 0;

  // Whether steady pulls from rest, of this increment and to less than this limit, reach a contact force without an event
  // on the way; false as well when the robot at rest is not clear of the obstacles.
  virtual bool reaches(double force, double increment, double limit, double length) = 0;

  int iterations = 0;                    // of Newton's method in the last follow
  std::vector<double>* trace = nullptr;  // when set, receives (x, y, angle) of every node at every accepted shape
};

// How an equilibrium has changed per millimetre of cable, to start the search for the next one; zero where it is free, or
// a contact came or went.
struct Trend {
  std::vector<Control> controls;
  std::vector<Position> mounts;
  std::array<double, limits::kMaxActive> multipliers{};  // in the order of the active set
};

// The follower for a robot with a uniform or a sliding cable, for scenes of this many obstacles.
std::unique_ptr<Follower> make_follower(bool sliding, const Robot& robot, int obstacles);

template <class Model>
class Branch : public Follower {
 public:
  Branch(const Robot& robot, int obstacles);

  std::size_t block_size() const override;
  void enter(std::span<const Obstacle> obstacles) override;
  Status follow(const double* from, const Command& target, double* to) override;
  bool reaches(double force, double increment, double limit, double length) override;

 private:
  enum class Move { kAccepted, kRejected, kOverTension };
  enum class End { kPassed, kSnapped, kBlocked, kOverTension };

  void load(const double* block);
  void store(double* block);
  double first_tension(const Command& start);
  Status follow(const Command& target);
  double goal_cable(double target) const;
  Move attempt(const Command& command);
  bool attempt_free();
  bool approach_limit();
  bool at_limit() const;
  bool releases(const Command& command) const;
  End pass_end(const Command& command);
  bool finish();
  bool depart(const Command& command, bool holding);
  bool descend(bool& moved);
  bool passable(double allowed) const;
  void accept();
  void learn();
  void forget();
  void predict();
  void remember();
  void settle();

  Newton<Model> newton_;
  Iterate present_, trial_;
  Trend trend_;  // of `present_`
  double tension_ = 0, trial_tension_ = 0;
  double onset_ = 0;      // tension where the present contact began
  bool touched_ = false;  // at the start
  std::vector<Position> nodes_, levers_;  // of the block last read
  std::vector<Position> points_, mounts_;  // of the last accepted shape
  bool settled_ = false;                  // whether the chain is evaluated at `present_`
};

}  // namespace ccr
