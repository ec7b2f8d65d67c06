// What a step of the solver reports: how it ended, why it was given up, what it cost, and how exact its equilibrium is.
#pragma once

namespace ccr {

// How a step ended; where several things happened, the highest value. The values are those of solver.Status in Python.
enum class Status { kConverged, kSnapped, kStalled, kBlocked, kGaveUp };

// Why a step was given up: a descent led to where a segment folds over, the step spent its budget of factorisations, or
// a descent found no way on.
enum class Reason { kNone, kFolded, kWork, kStuck };

struct StepResult {
  Status status = Status::kConverged;
  Reason reason = Reason::kNone;
  int iterations = 0;           // of Newton's method
  int factorizations = 0;       // of the KKT system
  bool interrupted = false;     // amid the step, which wrote nothing then
  double scene = 1;             // part of their way that moving obstacles have gone
  bool differentiated = false;  // whether slopes of the step were asked for and found
};

// Residuals of the KKT conditions, without units: the largest slope of the Lagrangian in a control [rad²], the largest
// gap that is violated, or open and active, over the robot's length, and the largest product of a multiplier and its
// gap [rad²].
struct Optimality {
  double stationarity = 0, gap = 0, complementarity = 0;
};

}  // namespace ccr
