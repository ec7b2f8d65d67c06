// An equilibrium continued from command to command along its branch, as the robot would move.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "model/obstacle.hpp"
#include "model/robot.hpp"
#include "solve/block_layout.hpp"
#include "solve/status.hpp"

namespace ccr {

// A steady pull from rest: displacements i * increment * direction below the limit, until the contact force is reached.
struct Ramp {
  double force;             // at which the pull ends [N]
  int obstacle;             // whose force is meant; -1 for all together
  const double* direction;  // displacement of each cable per millimetre
  double increment, limit;  // [mm]
  double length;            // of the backbone [mm]
};

// How slopes were found. Left out are gaps that the others imply.
struct SlopeResult {
  bool found = false;  // not where H is singular, closed gaps all but depend on each other, or there are too many
  int left_out = 0;
};

// Where the slopes of a step go: a row for each cable, with `in_length` for the length, and with `in_obstacles` for
// each motion of each obstacle, as those of `slopes`. Each is `slope_row` numbers and the slope of the clearance. None
// are written where `rows` is null, or none are found.
struct StepSlopes {
  double* rows = nullptr;
  bool in_length = false, in_obstacles = false;
};

// The continuation of one robot in the plane or in space, for scenes of a fixed number of obstacles. Holds scratch
// memory and no state between calls: an equilibrium is a block of numbers, laid out as `layout` says.
template <int D>
class Continuation {
 public:
  // Asked now and then during a call, in the thread of the call, whether to give it up.
  using Interruption = std::function<bool()>;

  virtual ~Continuation() = default;

  virtual const BlockLayout& layout() const = 0;

  // Switches to another robot of the same layout; `set_obstacles` must follow. Results are those of a continuation made
  // for it.
  virtual void set_robot(const Robot& robot) = 0;

  // Switches to another scene with the same number of obstacles. The span must outlive its use.
  virtual void set_obstacles(std::span<const Obstacle<D>> obstacles) = 0;

  virtual void set_interruption(Interruption interruption) = 0;

  // Writes the equilibrium of the robot at a length with no cable displaced. From its shape without loads, these are
  // raised evenly; a cable that is too short for that shape, or that its motor cannot hold, is paid out. Gives up where
  // only a part of the loads can be carried: that is no equilibrium.
  virtual StepResult rest(double length, double* to) = 0;

  // Takes the robot from the equilibrium in one block towards the command `target`, cables and length evenly, and
  // writes the equilibrium reached to another block, which may be the same. Writes nothing where it is interrupted.
  // Slopes are found of a step that converged, on the side to which its cables moved: where a gap is closed and not
  // pressed, or pressed by nothing but roundoff, it stays closed if it would be pressed farther that way, and opens
  // otherwise. A cable at its least displacement counts as pulled. A cable that could not be released because the robot
  // of the paper's models touches does not follow its command, and has no slopes but zeros.
  virtual StepResult follow(const double* from, const double* target, double* to, const StepSlopes& slopes = {}) = 0;

  // The same while the obstacles move evenly to others of the same kinds, as far as they can; `result.scene` says how
  // far. `motions` bounds the motion of the surface of each [mm]. Ends among the obstacles of `set_obstacles`.
  virtual StepResult move(const double* from, const double* target, std::span<const Obstacle<D>> towards,
                          std::span<const double> motions, double* to, const StepSlopes& slopes = {}) = 0;

  // The same as `follow`, appending every accepted shape to `shapes`: three numbers of each node, the points that can
  // touch, and the displacements of the obstacles.
  virtual StepResult trace(const double* from, const double* target, double* to, std::vector<double>& shapes) = 0;

  // Returns whether a ramp gets to its contact force without an event on the way; false as well where the robot at rest
  // overlaps an obstacle, or where it is interrupted. Writes the last force to `reached`.
  virtual bool ramp_reaches_force(const Ramp& ramp, double* reached) = 0;

  // Returns how well the equilibrium in a block meets its KKT conditions, evaluated anew from coordinates and
  // multipliers.
  virtual Optimality optimality(const double* block) = 0;

  // Writes the slopes of the free tip at a command, those that stand in a block.
  virtual void tip_slopes(const double* command, double* to) = 0;

  // Numbers of a row of `slopes`, and of these rows.
  virtual int slope_row() const = 0;
  virtual int parameters() const = 0;

  // Writes the slopes of the equilibrium in a block in its command, and also in its obstacles or not; see
  // solve/slopes.hpp. The contacts stay closed that `held` names with an entry for each, or where it is null those that
  // press.
  virtual SlopeResult slopes(const double* block, const bool* held, bool in_obstacles, double* to) = 0;
};

// Makes the continuation of a robot's model. The number of obstacles is that of every scene.
template <int D>
std::unique_ptr<Continuation<D>> make_continuation(const Robot& robot, int obstacles);

}  // namespace ccr
