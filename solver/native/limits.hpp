// Every tolerance and limit of the solver, named once. Lengths in mm. The size of a step is the largest change of a
// control (the sine of a shear angle, or the angle of a segment), or of a node's place over the length of the robot.
#pragma once

namespace ccr::limits {

// A point is an equilibrium when its stationarity residual is below
// kStationarity * (free segment angle)^2 + kRoundoff * (largest objective slope), with a sliding cable
// kStationarity * (largest objective slope), no gap is violated and the active ones are closed.
inline constexpr double kStationarity = 1e-9;
inline constexpr double kRoundoff = 1e-13;
inline constexpr double kFeasibility = 1e-10;
inline constexpr double kWidestTurn = 3.1;     // angle between consecutive disks, within which the laws hold
inline constexpr int kRelaxIterations = 8;     // of Newton's method for the shape that nothing touches
inline constexpr int kClosureIterations = 12;  // of Newton's method for the bending of a segment in space
inline constexpr double kWidestBend = 2.0;     // square of 2 sin θ/2 of a segment in space: a quarter turn
inline constexpr double kClosed = 1e-8;        // change of it that is the last one, being squared
inline constexpr double kRelaxed = 1e-12;      // relative change that is the last one, being squared

// Newton.
inline constexpr int kNewtonIterations = 10;
inline constexpr double kNewtonCap = 0.3;      // largest step of one iteration
inline constexpr double kNewtonClose = 1e-4;    // after a step this small the curvature is used once more
inline constexpr double kArmijo = 1e-4;
inline constexpr int kBacktracks = 6;

// Broad phase: a point farther than this from an obstacle is not looked at before the answer is [mm].
inline constexpr double kReach = 4.0;

// Active set.
inline constexpr int kMaxObstacles = 32;
inline constexpr int kMaxActive = 32;
inline constexpr int kActiveSetChanges = 96;
inline constexpr double kDependent = 1e-12;    // relative curvature below which a gap depends on the active ones

// Convexification: penalty on active gaps first, then damping of the controls, relative to the curvature at hand.
inline constexpr double kPenalty = 100.0;
inline constexpr double kPenaltyGrowth = 100.0;
inline constexpr int kPenalties = 4;
inline constexpr int kDescentPenalties = 2;
inline constexpr double kDamping = 1e-8;
inline constexpr double kDampingGrowth = 8.0;
inline constexpr int kDampingTries = 24;
inline constexpr double kMeasureDamping = 1.0; // where closeness of shapes is meant, not energy

// Continuation.
inline constexpr double kPretension = 0.05;    // cable displacement below which a touching robot is not slackened
inline constexpr double kLargestStep = 0.75;   // cable displacement, or half the insertion, of one sub-step
inline constexpr double kSmallestStep = 1e-4;
inline constexpr double kMoveOffset = 0.5;     // a node moves at most kMoveOffset + kMoveSlope * |step| in a sub-step
inline constexpr double kMoveSlope = 16.0;
inline constexpr double kMoveLargest = 8.5;    // and at most this, whatever the step
inline constexpr double kSweepDepth = 0.125;   // a point's path may cut this deep into an obstacle, and is looked at
inline constexpr double kSweepStride = 0.5;    // this often: fractions of the smallest radius of the obstacle's surface
inline constexpr int kSubSteps = 400;          // beside those of the largest size
inline constexpr int kBranchEnds = 24;         // ends met in one step before the robot counts as jammed

inline constexpr int kOnsetBisections = 20;    // to find where a contact began

// Stall: the cable stops where the tension is within this fraction below its limit.
inline constexpr double kTensionBand = 1e-6;
inline constexpr double kYield = 0.02;         // cable displacement a motor gives at a time when it cannot hold
inline constexpr int kStallIterations = 40;
inline constexpr double kCommandResolution = 1e-11;  // a narrower bracket is not searched

// Feasible descent after a branch end.
inline constexpr int kDescentIterations = 300;
inline constexpr int kFinishEvery = 8;         // iterates between trials of Newton's method
inline constexpr double kDescentCap = 0.03;    // largest step of one iterate
inline constexpr double kStretch = 8.0;        // of a damped iterate
inline constexpr double kDescentFeasibility = 1e-11;
inline constexpr double kHeld = 1e100;         // multiplier of a gap that a restoration must not release
inline constexpr double kEnergyRoundoff = 1e-15;
inline constexpr int kDescentBacktracks = 12;
inline constexpr int kRestorations = 8;
inline constexpr double kDescentMove = 4.0;    // largest node motion of one iterate
inline constexpr int kDescentShortenings = 4;  // of an iterate that moved farther, or through an obstacle

}  // namespace ccr::limits
