// A robot among obstacles at one trial shape: its points and their gaps beside what its model says.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "math/linalg.hpp"
#include "model/obstacle.hpp"
#include "model/robot.hpp"
#include "tolerances.hpp"

namespace ccr {

// ActiveSetQp that carry a multiplier. A contact is (obstacle * lines + line) * positions + position. After the last of
// these come, with a sliding cable, its slack, and of each segment where its disks meet on the side of the cable and
// opposite.
struct ActiveSet {
  int count = 0;
  std::array<int, tolerances::kMaxActive> contact;
  std::array<double, tolerances::kMaxActive> multiplier;

  void drop(int j) {
    --count;
    for (int k = j; k < count; ++k) {
      contact[k] = contact[k + 1];
      multiplier[k] = multiplier[k + 1];
    }
  }
};

// A shape and what holds it: coordinates of the segments, displacements of the mounted obstacles, contacts that push.
template <class Model>
struct Iterate {
  Command<Model::kCables> command{};
  std::vector<typename Model::Control> controls;
  std::vector<Position<Model::kSpace>> mounts;
  ActiveSet active;
};

// The points of all lines.
template <class Model>
void place_points(const Robot& robot, std::span<const Position<Model::kSpace>> nodes,
                  std::span<const typename Model::Frame> frames, std::vector<Position<Model::kSpace>>& points);

template <class Model>
class ContactProblem {
 public:
  static constexpr int kSpace = Model::kSpace, kState = Model::kState;
  using Position = ccr::Position<kSpace>;
  using Obstacle = ccr::Obstacle<kSpace>;
  using Command = ccr::Command<Model::kCables>;
  using Iterate = ccr::Iterate<Model>;
  using State = typename Model::State;
  using Control = typename Model::Control;
  using Frame = typename Model::Frame;
  using System = typename Model::System;
  using Force = typename System::Force;
  using Tensions = Vec<Model::kCables>;

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
  ContactProblem(const Robot& robot, int obstacles);

  // Goes among the obstacles of a scene, which must stay where they are while the problem is.
  void set_obstacles(std::span<const Obstacle> obstacles);

  // Measures how far each obstacle is from a shape, so that it can be passed over while the robot stays close to it.
  void update_broadphase(std::span<const Position> nodes, const std::vector<Position>& mounts);

  // Shape under the command; false when a coordinate leaves the range of the segment law.
  bool evaluate(const Iterate& at);

  // Adds energy, while `on`, to segments that shear so far that they come near to folding over, which no equilibrium of
  // interest does but a descent may pass through.
  void fence(bool on) { fenced_ = on; }
  bool at_fence() const { return fence_energy_ > 0; }  // of the last shape

  // The shape that no obstacle touches, which is known, and what holds it.
  void set_free_shape(Iterate& at);

  // Slope of the Lagrangian J - Σ λ c with respect to the controls, with the adjoints it is made of.
  void reduced_gradient(const ActiveSet& active);
  // Exact Hessian of the Lagrangian, and the tensions of the cables; both follow reduced_gradient.
  void lagrangian_hessian(const ActiveSet& active, System& system) const;
  Tensions tensions(const ActiveSet& active) const;
  Position contact_force(const ActiveSet& active, int obstacle) const;  // its force on the robot [N]
  Position mount_load(const ActiveSet& active, int mount) const;        // Σ λ ∇c of the contacts on a mount

  // Slopes of the tip of a robot that nothing touches in the cable displacements (eq. 7).
  auto free_slopes(const Command& command) { return model_.free_slopes(command); }

  const Robot& robot() const { return robot_; }
  std::span<const Obstacle> obstacles() const { return obstacles_; }
  // ActiveSetQp with obstacles, then the slack of a sliding cable, then the first of the disks that meet.
  int contacts() const { return static_cast<int>(mount_of_.size() * points_.size()); }
  bool touches_obstacle(const ActiveSet& active) const;  // any obstacle

  double objective() const { return model_.objective; }
  double energy() const { return energy_; }  // the objective and that of the springs, over the energy scale [rad^2]
  double spring_energy(const std::vector<Position>& mounts, double length) const;  // over the energy scale [rad^2]
  double violation() const;                                                        // largest -gap, at least 0
  double tolerance(const ActiveSet& active) const;                                 // of the slope of the Lagrangian
  double energy_scale() const { return robot_.energy_scale(model_.segment_length() * robot_.segments); }
  const std::vector<State>& states() const { return model_.states; }
  const std::vector<Frame>& frames() const { return model_.frames; }
  const std::vector<Position>& points() const { return points_; }  // (line, position)
  // ActiveSetQp within reach, and the gap of every contact, infinite for those that are not.
  const std::vector<int>& near_contacts() const { return near_; }
  const std::vector<double>& gaps() const { return gaps_; }
  bool out_of_reach(int obstacle, double motion) const;      // from any point, even after such a motion
  void all_gaps(double* gaps) const;                         // of every contact, whether within reach or not
  Gap<kSpace> gap(int contact) const;                        // with its derivatives in the point
  Force force(int contact, const Position& on_point) const;  // on the nodes, of one on the point
  Slope slope(int contact) const;
  int mounts() const { return static_cast<int>(springs_.size()); }
  int mount(int contact) const { return contact >= contacts() ? -1 : mount_of_[contact / points_.size()]; }
  int mount_of(int obstacle) const { return mount_of_[obstacle]; }
  const Mat<kSpace, kSpace>& spring(int mount) const { return springs_[mount]; }  // its stiffness over the robot's
  const std::vector<Position>& mount_gradient() const { return mount_gradient_; }
  int slack_contact() const { return contacts(); }
  int first_disk_contact() const { return contacts() + 1; }
  double lever_arm(int contact) const;  // of its motion per unit of a control, about [mm]
  const std::vector<Control>& gradient() const { return model_.gradient; }

 private:
  // Where a point is: this fraction of the way from a node to the next, at this place on the disks.
  struct Site {
    int node;
    double fraction;
    Vec<2> line;
  };

  const Obstacle& obstacle(int contact) const { return obstacles_[contact / points_.size()]; }
  Position point(int contact) const;  // in the frame of the mount
  const Site& site(int contact) const { return sites_[contact % points_.size()]; }
  Position lever(const Site& site, int node) const { return Model::lever(model_.frames[node], site.line); }
  Position displacement(int obstacle) const {
    return mount_of_[obstacle] < 0 ? Position{} : displacements_[mount_of_[obstacle]];
  }
  void add_disk_curvature(int contact, double scale, System& system) const requires(Model::kRod);
  void raise_fence(const std::vector<Control>& controls);
  void update_springs(const std::vector<Position>& mounts);
  void measure_gaps();
  void measure_slack_and_disks(const Command& command) requires(Model::kRod);
  DiskGap disk_gap(int contact) const requires(Model::kRod) {
    return model_.disk_gap((contact - first_disk_contact()) / 2, (contact - first_disk_contact()) % 2 == 0 ? 1 : -1);
  }

  Robot robot_;
  Model model_;
  std::span<const Obstacle> obstacles_;
  double reach_ = 0;  // from a node, within which its points may be near an obstacle
  double energy_ = 0;
  bool fenced_ = false;
  double fence_energy_ = 0;
  std::vector<Control> fence_slope_;  // (segments), while fenced
  std::vector<Mat<Model::kControl, Model::kControl>> fence_curvature_;
  std::vector<Position> origin_;        // nodes of the shape looked around from
  std::vector<Position> mount_origin_;  // mounts of that shape
  std::vector<double> clear_;           // how far its nodes may move before an obstacle is within reach
  double drift_ = 0;                    // how far they have
  std::vector<Position> nodes_;
  std::vector<Position> points_;
  std::vector<Site> sites_;  // of the points
  std::vector<double> gaps_;
  std::vector<int> near_;
  std::vector<int> mount_of_;                 // obstacle, -1 for a fixed one
  std::vector<Mat<kSpace, kSpace>> springs_;  // of the mounts
  std::vector<Position> displacements_;       // of the mounts
  std::vector<Position> mount_gradient_;
  std::vector<State> node_forces_;  // Σ λ ∇c at each node
};

}  // namespace ccr
