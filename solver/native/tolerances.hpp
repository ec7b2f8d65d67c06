// Every tolerance and limit of the solver, named once, and without units, so that a robot and its scene drawn on
// another scale are solved alike, to the bit where the scale is a power of two. Places and gaps are over the length L
// of the robot at its longest, displacements of a cable over its offset a. The size of a step is the largest change of
// a control (the sine of a shear angle, or the angle of a segment), or of a node's place over L.
#pragma once

namespace ccr::tolerances {

// A point is an equilibrium when its stationarity residual is below
// kStationarity * (free segment angle)^2 + kRoundoff * (largest objective slope), with a sliding cable
// kStationarity * (largest objective slope), no gap is violated and the active ones are closed.
inline constexpr double kStationarity = 1e-9;
inline constexpr double kRoundoff = 1e-13;
inline constexpr double kFeasibility = 5e-13;  // [L]
inline constexpr double kWidestTurn = 3.1;     // angle between consecutive disks, within which the laws hold
inline constexpr double kDisksClose = 0.5;     // of the angle at which disks meet: the gap is not looked at below it
inline constexpr int kRelaxIterations = 8;     // of Newton's method for the shape that nothing touches
inline constexpr int kClosureIterations = 12;  // of Newton's method for the bending of a segment in space
inline constexpr double kWidestBend = 2.0;     // square of 2 sin θ/2 of a segment in space: a quarter turn
inline constexpr double kClosed = 1e-8;        // change of it that is the last one, being squared
inline constexpr double kRelaxed = 1e-12;      // relative change that is the last one, being squared

// Newton.
inline constexpr int kNewtonIterations = 10;
inline constexpr double kNewtonCap = 0.3;     // largest step of one iteration
inline constexpr double kNewtonClose = 1e-4;  // after a step this small the curvature is used once more
inline constexpr double kArmijo = 1e-4;
inline constexpr int kBacktracks = 6;
inline constexpr int kDampedIterations = 2;  // at the start, where the curvature along the active gaps is not positive

// Broad phase: a point farther than this from an obstacle is not looked at before the answer is [L].
inline constexpr double kReach = 0.0225;

// Active set.
inline constexpr int kMaxObstacles = 32;
inline constexpr int kMaxActive = 32;
inline constexpr int kActiveSetChanges = 96;
inline constexpr double kDependent = 1e-12;  // relative curvature below which a gap depends on the active ones

// Convexification: penalty on active gaps first, then damping of the controls, relative to the curvature at hand.
inline constexpr double kPenalty = 100.0;
inline constexpr double kPenaltyGrowth = 100.0;
inline constexpr int kPenalties = 4;
inline constexpr int kDescentPenalties = 2;  // while a descent moves; all of them where it hardly does
inline constexpr double kDamping = 1e-8;
inline constexpr double kDampingGrowth = 8.0;
inline constexpr int kDampingTries = 24;
inline constexpr double kMeasureDamping = 1.0;  // where closeness of shapes is meant, not energy

// Continuation.
inline constexpr double kPretension = 0.00625;   // displacement below which a touching robot is not slackened [a]
inline constexpr double kInsertion = 11.25;      // displacement [a] that counts as much as an insertion by L
inline constexpr double kLargestStep = 0.09375;  // of one sub-step [a]
inline constexpr double kMeetingStep = 0.01;     // of one in which a narrow obstacle is met
inline constexpr double kSmallestStep = 1.25e-5;
inline constexpr double kPatientStep = 1e-4;   // within which Newton's method may begin with damped iterations
inline constexpr double kMoveOffset = 0.0028;  // a point moves at most kMoveOffset + kMoveSlope * |step| in a sub-step
inline constexpr double kMoveSlope = 0.71;
inline constexpr double kMoveLargest = 0.047;  // and at most this, whatever the step [L]
inline constexpr double kStill = 2.8e-4;       // a motion as small as this is not told from one along the branch [L]
inline constexpr double kOffTrend = 0.3;   // of the motion the trend tells, that an equilibrium on the branch is off it
inline constexpr double kUneven = 0.1;     // of the change of a tension: the mean it may be off the straight line
inline constexpr double kLost = 0.001;     // the same of the tension itself
inline constexpr double kReturned = 1e-3;  // of a motion, that the way back may end off its start
inline constexpr int kWork = 4500;         // factorisations of one step before it is given up
inline constexpr int kSubSteps = 400;      // beside those of the largest size
inline constexpr int kBranchEnds = 24;     // ends met in one step before the search is given up

// Sweep: how deep the straight way of a point may cut into an obstacle, over the radius of the largest ball inside it.
inline constexpr double kSweepDepth = 0.01;
inline constexpr double kSweepStride = 0.28;  // of the smallest radius of a surface: a way too short to cut so deep
inline constexpr int kSweepStrides = 256;     // along one way before it counts as barred
inline constexpr int kEdgeHalvings = 7;       // to find the deepest point of an edge

inline constexpr int kOnsetBisections = 20;  // to find where a contact began

// Stall: the cable stops where the tension is within this fraction below its limit.
inline constexpr double kTensionBand = 1e-6;
inline constexpr double kTight = 100.0;       // tension over EI / aL from which ever smaller steps are tried
inline constexpr double kTightStep = 1e-11;   // the smallest of them [a]
inline constexpr double kBarred = 1e-5;       // what is left of forces that balance each other
inline constexpr double kPeakStep = 1.25e-3;  // no peak of the tension is looked for within a step this small [a]
inline constexpr double kYield = 0.0025;      // displacement a motor gives at a time when it cannot hold [a]
inline constexpr int kStallIterations = 40;
inline constexpr double kCommandResolution = 1.25e-12;  // a narrower bracket is not searched [a]

// Feasible descent after a branch end.
inline constexpr double kFenceShear = 0.95;  // squared shear over its limit's from which it is fenced
inline constexpr double kFence = 10.0;       // curvature of the fence [rad^2]
inline constexpr int kDescentIterations = 300;
inline constexpr int kFinishEvery = 8;         // iterates between trials of Newton's method
inline constexpr double kDescentCap = 0.03;    // largest step of one iterate
inline constexpr double kSmallestPart = 1e-3;  // of the step that ends a branch, that a descent begins with
inline constexpr double kCreep = 1e-4;         // size of an iterate that hardly moves
inline constexpr double kStretch = 8.0;  // of the first damped iterate, and of the next ones over those that went well
inline constexpr double kDescentFeasibility = 6e-14;  // [L]
inline constexpr double kHeld = 1e100;                // multiplier of a gap that a restoration must not release
inline constexpr double kEnergyRoundoff = 1e-15;
inline constexpr int kDescentBacktracks = 12;
inline constexpr int kRestorations = 8;
inline constexpr double kDescentMove = 0.0225;  // largest node motion of one iterate [L]
inline constexpr int kDescentShortenings = 4;   // of an iterate that moved farther, or through an obstacle

}  // namespace ccr::tolerances
