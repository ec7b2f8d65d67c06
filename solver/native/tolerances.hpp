// Every tolerance and limit of the solver, named once. They have no units, so that a robot and its scene at another
// scale are solved alike, bit for bit where the scale is a power of two: lengths are over L, the longest length of the
// robot, and displacements of a cable over a, its offset. The size of a step is the largest change of a control (the
// sine of a shear angle, or the angle of a segment), or of a node's position over L.
#pragma once

namespace ccr::tolerances {

// A point is an equilibrium where no gap is violated, the active ones are closed, and the gradient of the Lagrangian is
// at most kStationarity * (angle of a free segment)² + kRoundoff * (largest slope of the objective or of a contact);
// for the rod the largest slope of the objective takes the place of the squared angle.
inline constexpr double kStationarity = 1e-9;
inline constexpr double kRoundoff = 1e-13;
inline constexpr double kUnbent = 1e-6;  // least slope of the objective that counts: of a rod that is all but straight
inline constexpr double kFeasibility = 5e-13;  // [L]
inline constexpr double kWidestTurn = 3.1;     // largest angle between consecutive disks in the range of the laws
inline constexpr double kDisksClose =
    0.5;  // fraction of the angle at which disks meet, below which their gap is not measured
inline constexpr int kRelaxIterations = 8;     // of Newton's method for the shape of the free rod
inline constexpr int kClosureIterations = 12;  // of Newton's method for the bending of a segment in space
inline constexpr double kWidestBend = 2.0;     // largest square of 2 sin θ/2 of a segment in space: a quarter turn
inline constexpr double kClosed = 1e-8;        // last change of the bending: convergence is quadratic
inline constexpr double kRelaxed = 1e-12;      // last relative change of the free angle: convergence is quadratic

// Newton.
inline constexpr int kNewtonIterations = 10;
inline constexpr double kNewtonCap = 0.3;        // largest step of one iteration
inline constexpr double kNewtonClose = 1e-4;     // after a step this small the factorisation serves once more
inline constexpr double kReuseClose = 1e-2;      // the same where it serves as long as each further step is at most
inline constexpr double kCorrectionRate = 0.05;  // this fraction of the last
inline constexpr double kArmijo = 1e-4;
inline constexpr int kBacktracks = 6;
inline constexpr int kDampedIterations = 2;  // at the start of a small sub-step, where H is not positive definite

// Broad phase: the gap of a point farther than this from an obstacle is not measured during a step [L].
inline constexpr double kReach = 0.0225;

// Active set.
inline constexpr int kMaxObstacles = 32;
inline constexpr int kMaxActive = 64;  // a robot of 18 segments presses against a narrow channel at more than 32 points
inline constexpr int kMaxTrend = 32;   // with more active gaps, no trend of theirs is kept
inline constexpr int kActiveSetChanges = 96;
inline constexpr double kDependent =
    1e-12;  // relative curvature below which a gap is linearly dependent on the active ones
inline constexpr double kNearlyDependent = 1e-6;  // the same of one that may take the place of another
inline constexpr double kToDifferentiate = 1e-8;  // the same below which rounding would spoil derivatives
inline constexpr double kNoPart = 1e-18;          // share of a gap in a combination that is roundoff
inline constexpr double kPressed = 10.0;  // share of a contact in the balance that is roundoff, over its tolerance
inline constexpr double kAlong = 1e-9;    // motion of a gap or multiplier that is roundoff, over that of the cables

// Convexification: a penalty on active gaps first, then damping of the unknowns, both relative to the largest
// curvature.
inline constexpr double kPenalty = 100.0;
inline constexpr double kPenaltyGrowth = 100.0;
inline constexpr int kPenalties = 4;
inline constexpr int kDescentPenalties = 2;  // while a descent moves; kPenalties where it hardly does
inline constexpr double kDamping = 1e-8;
inline constexpr double kDampingGrowth = 8.0;
inline constexpr int kDampingTries = 24;
inline constexpr int kPenaltyWork = 1200;    // factorisations of a step, after which it counts the inertia instead
inline constexpr double kNormDamping = 1.0;  // of the norm that measures closeness of shapes

// Continuation.
inline constexpr double kPretension = 0.00625;   // a robot in contact is not slackened below this displacement [a]
inline constexpr double kPush = 1e-9;            // tension below zero that is roundoff [EI/aL]
inline constexpr double kInsertion = 11.25;      // displacement that counts as much as an insertion by L [a]
inline constexpr double kMotion = 11.25;         // displacement that counts as much as a motion of obstacles by L [a]
inline constexpr double kLoading = 2.0;          // displacement that counts as much as raising all loads [a]
inline constexpr double kLargestStep = 0.09375;  // sub-step [a]
inline constexpr double kMeetingStep = 0.01;     // sub-step that may meet a narrow obstacle, or another side of one [a]
inline constexpr double kFacing = 0.7;           // least cosine of the angle between the sides faced and met
inline constexpr double kSmallestStep = 1.25e-5;  // sub-step before a branch counts as ended [a]
inline constexpr double kPatientStep =
    1e-4;  // sub-step up to which Newton's method may begin with damped iterations [a]
inline constexpr double kMoveOffset =
    0.0028;  // in contact, a point moves at most kMoveOffset + kMoveSlope * |sub-step| [L]
inline constexpr double kMoveSlope = 0.71;
inline constexpr double kMoveLargest = 0.047;  // and at most this in any sub-step [L]
inline constexpr double kStill = 2.8e-4;       // motion that cannot be distinguished from one along the branch [L]
inline constexpr double kOffTrend =
    0.3;  // largest deviation from the trend on a branch, as a fraction of the predicted change
inline constexpr double kUnevenChange =
    0.1;  // mean deviation of a tension from a straight line, as a fraction of its change
inline constexpr double kUnevenTension = 0.001;  // the same, as a fraction of the tension
inline constexpr double kReturned = 1e-3;  // deviation from the start after the way back, as a fraction of the motion
inline constexpr int kWork = 4500;         // budget of factorisations of a step
inline constexpr int kPollPoints = 20000;  // points moved by sub-steps and iterates between polls for an interruption
inline constexpr int kSubSteps = kWork;    // budget of sub-steps: one that needs Newton's method factors at least once

// Sweep: allowed depth of a point's straight path in an obstacle, over the radius of the largest ball inside it.
inline constexpr double kSweepDepth = 0.01;
inline constexpr double kSweepStride = 0.28;  // path that cannot cut so deep, over the smallest radius of curvature
inline constexpr int kSweepStrides = 256;     // along one path before it counts as obstructed
inline constexpr int kEdgeHalvings = 7;       // bisections for the deepest point of an edge

inline constexpr int kOnsetParts = 1 << 20;  // of the way, to one of which it is known where a contact began

// Stall: a cable stops where its tension is within the fraction kTensionBand below the limit.
inline constexpr double kTensionBand = 1e-6;
inline constexpr double kTight = 100.0;      // tension over EI/aL from which sub-steps below kSmallestStep are tried
inline constexpr double kTightStep = 1e-11;  // the smallest of them [a]
inline constexpr int kCreeps = 3;            // descents from such sub-steps, after which one goes farther
inline constexpr double kRefining = 1e-2;    // of the sub-step before a branch counts as ended, where nothing leads on
inline constexpr double kBalance = 1e-5;  // residual of multipliers that balance each other, over the largest of them
inline constexpr double kPeakStep = 1.25e-3;  // sub-step within which a peak of the tension is ignored [a]
inline constexpr double kProbe = 1e-5;        // sub-step that shows whether a tension at its limit rises [a]
inline constexpr double kRise = 1e-8;         // least rise of it then, over the limit
inline constexpr int kSettling = 3;           // iterations for an equilibrium of cables that pull against each other
inline constexpr double kYield = 0.0025;      // first displacement by which an overloaded motor yields [a]
inline constexpr double kFirstLimit = 8.0;    // first limit over EI/aL past the balance of cables that lock a robot
inline constexpr int kJumps = 8;              // of a tension over the limit in a step, after which its cable is held
inline constexpr int kStallIterations = 40;
inline constexpr double kCommandResolution = 1.25e-12;  // smallest difference of commands [a]

// Feasible descent after a branch end.
inline constexpr double kBarrierShear =
    0.95;  // squared shear, over that of a segment that folds over, where the barrier begins
inline constexpr double kBarrierCurvature = 10.0;  // curvature of the barrier [rad²]
inline constexpr int kDescentIterations = 300;
inline constexpr int kShearingIterations = 1000;  // the same of the paper's models, which may shear segment by segment
inline constexpr int kFinishEvery = 8;            // iterates between trials of Newton's method
inline constexpr double kDescentCap = 0.03;       // largest step of one iterate
inline constexpr int kLongDescent = 100;          // iterates, after which those of the paper's models may be
inline constexpr double kDescentStride = 0.1;     // as large as this, and those of the rod which move too far
inline constexpr double kFilled = 0.9;            // are shortened to this part of kDescentMove,
inline constexpr double kFar = 0.5;               // and do not count from this part on
inline constexpr double kSmallestPart =
    1e-3;  // smallest first step of a descent, as a fraction of the sub-step that ended the branch
inline constexpr double kCreep = 1e-4;    // size of an iterate that hardly moves
inline constexpr double kOvershot = 0.7;  // part of an iterate of a long descent, where the energy is least on its way
inline constexpr double kStretch = 8.0;   // growth of damped iterates that succeed
inline constexpr double kDescentFeasibility = 6e-14;  // [L]
inline constexpr double kHeld = 1e100;                // multiplier that keeps a gap in the active set of a restoration
inline constexpr double kEnergyRoundoff = 1e-15;
inline constexpr int kDescentBacktracks = 12;
inline constexpr int kRestorations = 8;
inline constexpr double kDescentMove = 0.0225;  // largest motion of a point in one iterate [L]
inline constexpr int kDescentShortenings = 4;   // of an iterate that moved farther, or through an obstacle
inline constexpr double kProgress = 1e-3;       // least motion of an iterate after its restoration, over that before it
inline constexpr int kFlat = 8;                 // iterates that lose no energy, after which a saddle is suspected
inline constexpr int kPatience = 32;         // iterates that drop a gap which H needs, after which one slides along it
inline constexpr int kFruitless = 64;        // the same, after which a descent that wanders in roundoff ends
inline constexpr int kSofteningRounds = 16;  // of inverse iteration for the direction of least curvature
inline constexpr int kBucklings = 12;        // bends out of a shape, each half of the last and to the other side
inline constexpr int kSaddleTries = 10;      // steps along it, each a quarter of the last

}  // namespace ccr::tolerances
