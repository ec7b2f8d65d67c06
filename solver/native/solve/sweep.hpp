// Whether a robot passed through an obstacle on the straight ways from one accepted shape to the next.
//
// Contact is at points, so an edge between two of them may rest on an outline and lie in the obstacle by up to half its
// length h: a point of it is no farther than that from the nearer end, which is outside. What no robot can do is have
// an edge in the core of the obstacle, the points deeper in it than h/2.
#pragma once

#include "model/obstacle.hpp"

namespace ccr {

// How deep a point is in an obstacle, as exactly as its outline is given; at most 0 outside, and then no nearer than
// that [mm].
template <int D>
double depth(const Obstacle<D>& obstacle, const Position<D>& point);

// How far from the obstacle a point of some gap is, or less [mm].
template <int D>
double distance_outside(const Obstacle<D>& obstacle, double gap);

// Whether the straight way between two points outside cuts into the obstacle by no more than a little.
template <int D>
bool path_clear(const Obstacle<D>& obstacle, const Position<D>& from, const Position<D>& to);

// An edge between two neighbouring points.
template <int D>
struct Edge {
  Position<D> start, end;
};

// Whether the edge stays out of the points deeper than `half` on the straight ways of its ends.
template <int D>
bool edge_clear(const Obstacle<D>& obstacle, const Edge<D>& from, const Edge<D>& to, double half);

// The longest ways of all points for which path_clear and edge_clear, with edges of at most this length, need no look.
template <int D>
double harmless_path(const Obstacle<D>& obstacle);
template <int D>
double harmless_motion(const Obstacle<D>& obstacle, double longest);

}  // namespace ccr
