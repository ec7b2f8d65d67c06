// Whether a robot passed through an obstacle, on straight paths of its points between two accepted shapes.
//
// Gaps constrain points, so an edge of length h between two of them may cut into an obstacle by up to h/2. No feasible
// robot has an edge in the core of the obstacle, the points deeper than h/2: a passage is a path through the core.
#pragma once

#include "model/obstacle.hpp"

namespace ccr {

// Returns the depth of a point in an obstacle, as exact as its outline is. At most 0 outside, where its size is a lower
// bound on the distance [mm].
template <int D>
double depth(const Obstacle<D>& obstacle, const Position<D>& point);

// Returns a lower bound on the distance of a point from the obstacle, given its gap [mm].
template <int D>
double distance_outside(const Obstacle<D>& obstacle, double gap);

// Whether the straight path between two points outside is nowhere deeper than the tolerance.
template <int D>
bool path_clear(const Obstacle<D>& obstacle, const Position<D>& from, const Position<D>& to);

// An edge between two neighbouring points.
template <int D>
struct Edge {
  Position<D> start, end;
};

// Whether an edge, its ends on straight paths, stays out of the points deeper than `half`.
template <int D>
bool edge_clear(const Obstacle<D>& obstacle, const Edge<D>& from, const Edge<D>& to, double half);

// Return the longest paths for which path_clear, and edge_clear with edges up to `longest`, hold without a check.
template <int D>
double harmless_path(const Obstacle<D>& obstacle);
template <int D>
double harmless_motion(const Obstacle<D>& obstacle, double longest);

}  // namespace ccr
