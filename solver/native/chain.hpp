// The planar robot among obstacles at one trial shape: kinematics, objective, gaps and their derivatives.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "limits.hpp"
#include "linalg.hpp"
#include "obstacle.hpp"
#include "riccati.hpp"
#include "segment.hpp"

namespace ccr {

struct Robot {
  int segments;
  double offset;       // cable from backbone [mm]
  double rigidity;     // EI [N mm^2]
  double max_tension;  // [N]
  double max_length;   // of the backbone [mm]
  std::vector<double> lines;  // distance of each line of points that can touch, from the backbone towards the cable [mm]
  int between;                // points of a line between two nodes

  int positions() const { return segments * (between + 1) + 1; }  // of a line
  int points() const { return static_cast<int>(lines.size()) * positions(); }
  double stiffness(double length) const { return rigidity * segments / (2 * length); }  // EI / 2 l0 [N mm]
};

struct Command {
  double cable, length;  // displacement of the cable, length of the backbone [mm]
};

using Control = Vec<1>;  // the coordinate of a segment

// Dynamics of a segment in its lower state: the identity, and the motion of the next node per turn of the disk.
struct Turn {
  double x, y;
};

template <int N>
Vec<N> times(const Turn& a, Vec<N> s) {
  s[0] += a.x * s[2];
  s[1] += a.y * s[2];
  return s;
}

template <int R, int N>
Mat<R, N> times(Mat<R, N> m, const Turn& a) {
  for (int r = 0; r < R; ++r) m(r, 2) += m(r, 0) * a.x + m(r, 1) * a.y;
  return m;
}

template <int N, int C>
Mat<N, C> transpose_times(const Turn& a, Mat<N, C> m) {
  for (int c = 0; c < C; ++c) m(2, c) += a.x * m(0, c) + a.y * m(1, c);
  return m;
}

template <class Model>
using State = Vec<Model::kState>;

template <class Model>
using System = Riccati<Model::kState, 1, Turn>;

// Contacts that carry a multiplier. A contact is (obstacle * lines + line) * positions + position; the one after the last
// is a sliding cable, whose gap is its slack.
struct ActiveSet {
  int count = 0;
  std::array<int, limits::kMaxActive> contact;
  std::array<double, limits::kMaxActive> multiplier;

  void drop(int j) {
    --count;
    for (int k = j; k < count; ++k) {
      contact[k] = contact[k + 1];
      multiplier[k] = multiplier[k + 1];
    }
  }
};

// A shape and what holds it: coordinates of the segments, displacements of the mounted obstacles, contacts that push.
struct Iterate {
  Command command{};
  std::vector<Control> controls;
  std::vector<Position> mounts;
  ActiveSet active;
};

// The points of all lines, from backbone points and levers of the nodes.
void place_points(const Robot& robot, std::span<const Position> nodes, std::span<const Position> levers,
                  std::vector<Position>& points);

template <class Model>
class Chain {
 public:
  using State = ccr::State<Model>;
  using System = ccr::System<Model>;
  using Force = typename System::Force;

  // Of a gap in the states of the nodes beside its point, and in the displacement of the mount it is on, which is
  // that of the point with the opposite sign.
  struct Slope {
    Force force;
    int mount;  // -1 for an obstacle that is fixed
    Position normal;

    template <class Direction>
    double along(const Direction& d) const {
      return force.along(d.states) - (mount < 0 ? 0.0 : dot(normal, d.mounts[mount]));
    }
  };

  // For scenes of this many obstacles.
  Chain(const Robot& robot, int obstacles);

  // Goes among the obstacles of a scene, which must stay where they are while the chain is.
  void enter(std::span<const Obstacle> obstacles);

  // Measures how far each obstacle is from a shape, so that it can be passed over while the robot stays close to it.
  void look_around(std::span<const Position> nodes, const std::vector<Position>& mounts);

  // Shape under the command; false when a coordinate leaves the range of the segment law.
  bool evaluate(const Iterate& at);

  // The shape that no obstacle touches, which is known, and what holds it.
  void relax(Iterate& at);

  // Slope of the Lagrangian J - Σ λ c with respect to the controls, with the adjoints it is made of.
  void reduced_gradient(const ActiveSet& active);
  // Exact Hessian of the Lagrangian, and the tension of the cable; both follow reduced_gradient.
  void curvature(const ActiveSet& active, System& system) const;
  double tension(const ActiveSet& active) const;
  Position push(const ActiveSet& active, int obstacle) const;  // its force on the robot [N]

  // Slopes of the tip's pose in the cable displacement of a robot that nothing touches (eq. 7).
  Vec<3> free_slopes(const Command& command);

  const Robot& robot() const { return robot_; }
  std::span<const Obstacle> obstacles() const { return obstacles_; }
  int contacts() const { return static_cast<int>(mount_of_.size() * points_.size()); }
  bool touching(const ActiveSet& active) const;  // any obstacle

  double objective() const { return objective_; }
  double energy() const { return energy_; }  // the objective and that of the springs, over the stiffness [rad^2]
  double violation() const;  // largest -gap, at least 0
  double steepest() const { return steepest_; }  // largest slope of the objective alone
  double tolerance() const;  // of the slope of the Lagrangian
  double stiffness() const { return robot_.stiffness(length_ * robot_.segments); }
  const std::vector<State>& states() const { return states_; }
  const std::vector<Position>& levers() const { return levers_; }  // cable point from its backbone point
  const std::vector<Position>& points() const { return points_; }  // (line, position)
  // Contacts within reach, and the gap of every contact, infinite for those that are not.
  const std::vector<int>& near() const { return near_; }
  const std::vector<double>& gaps() const { return gaps_; }
  bool far(int obstacle, double motion) const;  // from any point, even after such a motion
  void survey(double* gaps) const;  // of every contact, whether within reach or not
  Gap gap(int contact) const;                                 // with its derivatives in the point
  Force force(int contact, const Position& on_point) const;   // on the nodes, of one on the point
  Slope slope(int contact) const;
  int mounts() const { return static_cast<int>(springs_.size()); }
  int mount(int contact) const { return contact == contacts() ? -1 : mount_of_[contact / points_.size()]; }
  int mount_of(int obstacle) const { return mount_of_[obstacle]; }
  const Mat<2, 2>& spring(int mount) const { return springs_[mount]; }  // its stiffness over that of the robot
  const std::vector<Position>& mount_gradient() const { return mount_gradient_; }
  double lever_arm(int contact) const;  // of its motion per unit of a control, about [mm]
  const std::vector<Control>& gradient() const { return gradient_; }

 private:
  // Where a point is: this fraction of the way from a node to the next, beside the backbone by a multiple of the lever.
  struct Site {
    int node;
    double fraction, lever;
  };

  const Obstacle& obstacle(int contact) const { return obstacles_[contact / points_.size()]; }
  Position point(int contact) const;  // in the frame of the mount
  const Site& site(int contact) const { return sites_[contact % points_.size()]; }
  Control relaxed(const Command& command);  // the coordinate of every segment then, whose law stands in `one_`
  void load_springs(const std::vector<Position>& mounts);
  void measure_gaps(double slack);

  Robot robot_;
  std::span<const Obstacle> obstacles_;
  double reach_ = 0;  // from a node, within which its points may be near an obstacle
  double pull_ = 0, length_ = 0;  // cable displacement and backbone of a segment [mm]
  double objective_ = 0, energy_ = 0, steepest_ = 0;
  typename Model::Bends bends_;
  typename Model::Bends one_;  // a segment that nothing touches, relaxed under the last command asked about
  Command relaxed_at_{-1, 0};
  Control relaxed_{};
  std::vector<Position> origin_;  // nodes of the shape looked around from
  std::vector<Position> mount_origin_;  // mounts of that shape
  std::vector<double> clear_;     // how far its nodes may move before an obstacle is within reach
  double drift_ = 0;              // how far they have
  std::vector<State> states_;
  std::vector<Position> nodes_;
  std::vector<Position> levers_;
  std::vector<Position> points_;
  std::vector<Site> sites_;  // of the points
  std::vector<double> gaps_;
  std::vector<int> near_;
  std::vector<int> mount_of_;            // obstacle, -1 for a fixed one
  std::vector<Mat<2, 2>> springs_;       // of the mounts
  std::vector<Position> displacements_;  // of the mounts
  std::vector<Position> mount_gradient_;
  std::vector<State> pulls_;     // Σ λ ∇c at each node
  std::vector<State> adjoints_;  // of the state each segment leads to
  std::vector<Control> gradient_;
};

}  // namespace ccr
