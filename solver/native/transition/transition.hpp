// One step of many environments: command, equilibrium, sensing, estimate, reward and observation.
#pragma once

#include <vector>

#include "transition/estimator.hpp"
#include "transition/lift.hpp"
#include "transition/observer.hpp"
#include "transition/sensors.hpp"

namespace ccr {

// The stages of a step, in order, and the slopes of where a robot is, whatever has brought it there. Where another
// solver moves the robots, it does so in place of the stages that move.
enum class Stage {
  kMark,
  kCommand,
  kMove,
  kReach,
  kMoveModel,
  kSense,
  kMoveFree,
  kEstimate,
  kRead,
  kReward,
  kObserve,
  kDerive,
  kDeriveHere
};

struct TaskSettings {
  int target;                   // obstacle whose force is regulated; -1 for all together
  bool vector;                  // whether the set-point is a vector
  bool estimated;               // whether the estimate is regulated, otherwise the force itself
  int profile_steps;            // of a moving set-point
  double force_limit;           // above which there is a cost [N]
  double length_mm;             // L of the robot
  std::vector<double> weights;  // of the reward terms
};

// State of N episodes.
struct EpisodeArrays {
  RowsOf<double> actuated, actions;      // coordinates [mm], and the last actions
  RowsOf<std::int64_t> time;             // steps of the episode
  RowsOf<const double> desired, goal;    // set-points, the largest where they move [N]
  RowsOf<const double> profile;          // its factors; none where it does not move
  RowsOf<const double> obstacle, robot;  // observed features of both
  RowsOf<double> tensions, onsets;       // as the motors see them; those before the model's contact [N]
};

// What is read of N robots after a step.
struct ReadingArrays {
  RowsOf<double> force_true, force_est, force_paper, regulated;  // [N]
  RowsOf<double> goal;                                           // set-point, a magnitude or a vector [N]
  RowsOf<double> force, desired, error, cost;                    // of the regulated force; relative error
  RowsOf<double> terms, reward;
  RowsOf<double> actuators;  // displacements and tensions of the cables, and the length where the base is inserted
  RowsOf<float> observation;
};

inline constexpr int kMostAhead = 16;  // steps ahead at which a moving set-point is shown

// Slopes of what was read after a step in its inputs: the coordinates that the robot was commanded to, and where
// sensing is not ideal also the positions of the motors. A row for each robot, and in it one for each input.
struct SlopeArrays {
  RowsOf<double> observation;                       // as it is now, without delay
  RowsOf<double> force_true, force_est, regulated;  // (inputs, D)
  RowsOf<double> reward;
  RowsOf<float> present;  // the observation without delay
  // Of the motors in the action and in where they were, of the coordinates in the motors, and of the reward in the
  // action itself, (actions).
  RowsOf<double> motor_per_action, motor_per_motor, follows, effort;
  RowsOf<bool> found;  // whether the robot converged, and has slopes
};

// What is read of one robot, in numbers or duals.
template <class T, int D>
struct Reading {
  T force_true[D], force_est[D], force_paper[D], regulated[D];
  double goal[D], desired;
  T force, error, cost;
};

template <int D>
class Transition {
 public:
  // `model` is that of `robots` where sensing is ideal, and `sensors` are none then. The estimator outlives it. Slopes
  // are found where there are arrays for them.
  Transition(BatchArrays<D> robots, BatchArrays<D> model, const Actuation& actuation, const Sensors& sensors,
             const Estimator<D>& estimator, ObserverSettings observer, TaskSettings task, EpisodeArrays episodes,
             ReadingArrays readings, SlopeArrays slopes);

  Batch<D>& batch() const { return *robots_.batch; }
  Batch<D>& model() const { return *model_.batch; }
  Batch<D>* free() const { return estimator_.free().batch; }
  const Actuation& actuation() const { return actuation_; }
  const double* block(int robot) const { return robots_.blocks[robot]; }
  const Sensors& sensors() const { return sensors_; }
  std::int64_t time(int robot) const { return *episodes_.time[robot]; }
  bool differentiates() const { return static_cast<bool>(slopes_.observation); }

  // Goes through stages of a step of a robot, with a row of actions; false where it was interrupted amid one.
  bool run(int thread, int robot, const double* action, Stage first, Stage last);

 private:
  bool run(int thread, int robot, const double* action, Stage stage);
  bool moves(int thread, int robot, Stage stage);
  void mark(int robot);
  void command(int robot, const double* action);
  void reach(int robot);
  void sense(int robot);
  void estimate(int robot);
  void keep(int robot);
  void reward(int robot);
  void observe(int thread, int robot);
  void derive(int thread, int robot, bool of_step);
  template <int P>
  void derive(int thread, int robot, int first);
  template <int P>
  void lift_tip_slopes(int thread, int robot, const Dual<P>* command, Dual<P>* block) const;
  template <int P>
  void write_slopes(int robot, int first, const Reading<Dual<P>, D>& reading, const Dual<P>& clearance,
                    const std::vector<Dual<P>>& row);

  bool senses() const { return static_cast<bool>(sensors_); }
  int inputs() const { return (senses() ? 2 : 1) * actuation_.actions; }
  const double* encoders(int robot) const { return senses() ? sensors_.motor[robot] : episodes_.actuated[robot]; }
  double desired(int robot, int ahead) const;
  double effort(int robot) const;
  // Displacement of a cable, that of the other one of a pair counted the other way.
  double displacement(const double* block, int cable) const;
  template <class T>
  const T* force(const T* block) const;
  template <class T>
  T target_share(const T* block) const;
  template <class T>
  Reading<T, D> read(int robot, const T* block, const T* known, const T& chosen, const T& paper) const;
  template <class T>
  Shown<T> shown(int robot, const T* known, const Reading<T, D>& reading, const T* encoders, const T* tensions,
                 const T* free_forces, const T* levers, const double* ahead) const;
  void write_ahead(int robot, double* to) const;

  BatchArrays<D> robots_, model_;
  BlockLayout layout_;
  Actuation actuation_;
  Sensors sensors_;
  const Estimator<D>& estimator_;
  Observer<D> observer_;
  TaskSettings task_;
  EpisodeArrays episodes_;
  ReadingArrays readings_;
  SlopeArrays slopes_;
  SlopeTable robot_slopes_, model_slopes_, free_slopes_;
  std::vector<double> before_;             // displacements of cables before the step, (robots, cables)
  std::vector<double> commanded_;          // coordinates that the robots were commanded to, (robots, actions)
  std::vector<std::vector<double>> rows_;  // of observations, scratch memory of each thread
};

}  // namespace ccr
