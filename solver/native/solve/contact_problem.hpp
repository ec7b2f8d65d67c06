// The nonlinear program of an equilibrium, evaluated at a trial shape: minimise the energy J of robot and springs
// subject to gaps c >= 0 of its points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "math/linalg.hpp"
#include "model/law_slopes.hpp"
#include "model/obstacle.hpp"
#include "model/robot.hpp"
#include "tolerances.hpp"

namespace ccr {

// Contacts in the active set and their multipliers λ >= 0. The index of a contact with an obstacle is
// (obstacle * lines + line) * positions + position. For the rod, the slacks of the cables follow, then the contacts of
// the disks of each segment, on each side where they can meet.
struct ActiveSet {
  int count = 0;
  std::array<int, tolerances::kMaxActive> contact;
  std::array<double, tolerances::kMaxActive> multiplier;

  // Copies only what is in use.
  ActiveSet() = default;
  ActiveSet(const ActiveSet& other) { *this = other; }
  ActiveSet& operator=(const ActiveSet& other) {
    count = other.count;
    for (int j = 0; j < count; ++j) {  // most often one or two
      contact[j] = other.contact[j];
      multiplier[j] = other.multiplier[j];
    }
    return *this;
  }

  friend bool operator==(const ActiveSet& a, const ActiveSet& b) {
    return a.count == b.count && std::equal(a.contact.begin(), a.contact.begin() + a.count, b.contact.begin()) &&
           std::equal(a.multiplier.begin(), a.multiplier.begin() + a.count, b.multiplier.begin());
  }

  void drop(int j) {
    --count;
    for (int k = j; k < count; ++k) {
      contact[k] = contact[k + 1];
      multiplier[k] = multiplier[k + 1];
    }
  }
};

// Unknowns of the program: controls of the segments, displacements of the mounts, and the active set.
template <class Model>
struct Iterate {
  Command<Model::kCables> command{};
  std::vector<typename Model::Control> controls;
  std::vector<Position<Model::kSpace>> mounts;
  ActiveSet active;
};

// Writes the points of all lines, by line and position.
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

  // Gradient of a gap in the states of the nodes beside its point and, with the opposite sign of that in the point, in
  // the displacement of its mount; that of a slack is in the controls alone.
  struct Slope {
    Force force;
    int mount;  // -1 for a fixed obstacle
    Position normal;
    const Control* minus_controls = nullptr;  // (n), negated as a right-hand side of the controls is

    template <class Direction>
    double along(const Direction& d) const {
      if constexpr (Model::kRod)
        if (minus_controls) return -dot_controls(minus_controls, d.controls);
      return force.along(d.states) - (mount < 0 ? 0.0 : dot(normal, d.mounts[mount]));
    }
  };

  static double dot_controls(const Control* a, const std::vector<Control>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < b.size(); ++i) sum += dot(a[i], b[i]);
    return sum;
  }

  // `obstacles` is the number of obstacles of every scene.
  ContactProblem(const Robot& robot, int obstacles);

  // Switches to a robot with the same numbers of segments, cables and points; obstacles are to be set again.
  void set_robot(const Robot& robot);

  // Switches to another scene with the same number of obstacles. The span must outlive its use.
  void set_obstacles(std::span<const Obstacle> obstacles);

  // Lets the obstacles move evenly to others, with `Command::scene` from 0 to 1, until the next `set_obstacles`. The
  // spans must outlive their use; `motions` bounds the motion of the surface of each [mm].
  void move_obstacles(std::span<const Obstacle> towards, std::span<const double> motions);
  bool is_moving() const { return !motions_.empty(); }
  // Bound on the motion of the surface of any obstacle between two parts of the way, and the motion of one's centre.
  double obstacle_motion(double from, double to) const { return largest_motion_ * std::abs(to - from); }
  Position displacement(int obstacle, double from, double to) const;

  // Measures the distance of each obstacle from a shape, so that it is skipped while the robot stays close to that
  // shape.
  void update_broadphase(std::span<const Position> nodes, const std::vector<Position>& mounts);

  // Evaluates energy, points and gaps, if not done already; false where a control is out of range of the segment law.
  bool evaluate(const Iterate& at);

  // Sets the limit of the tensions; that of the robot until then.
  void limit_tensions(double limit) { robot_.max_tension = limit; }

  // Lets the motor of a rod's cable keep a tension [N], infinite for one that holds its length instead: the length then
  // follows the shape, and the cable is a load of the robot and no longer one of its gaps.
  void keep_tension(int cable, double tension);
  bool keeps_tension(int cable) const { return kept_tensions_[cable] < HUGE_VAL; }
  const Tensions& kept_tensions() const { return kept_tensions_; }  // infinite for motors that hold a length
  double kept_multiplier(int cable) const { return kept_multipliers_[cable]; }
  bool keeps_tensions() const { return keeps_tensions_; }  // of any cable

  // While `on`, adds a barrier energy to segments that come near to folding over, which no equilibrium of interest does
  // but a descent might.
  void enable_barrier(bool on) {
    barrier_enabled_ = on;
    evaluated_ = false;
  }
  bool in_barrier() const { return barrier_energy_ > 0; }  // whether a segment of the last shape is in the barrier

  // Sets the equilibrium of the robot that nothing touches, where it has a closed form.
  void set_free_shape(Iterate& at);

  // Computes the gradient of the Lagrangian J - Σ λ c in controls and mounts, if not done already.
  void reduced_gradient(const ActiveSet& active);
  // Exact Hessian of the Lagrangian, and the tensions of the cables [N]; both follow reduced_gradient.
  void lagrangian_hessian(const ActiveSet& active, System& system) const;
  Tensions tensions(const ActiveSet& active) const;
  Position contact_force(const ActiveSet& active, int obstacle) const;  // of an obstacle on the robot [N]
  Position mount_load(const ActiveSet& active, int mount) const;        // Σ λ ∇c over the contacts with a mount

  // Derivatives of the free robot's tip in the displacements (eq. 7).
  auto free_slopes(const Command& command) { return model_.free_slopes(command); }

  const Robot& robot() const { return robot_; }
  std::span<const Obstacle> obstacles() const { return obstacles_; }
  // Number of contacts with obstacles; the slacks of a rod's cables are the next indices, then its disks.
  int contacts() const { return static_cast<int>(mount_of_.size() * points_.size()); }
  bool touches_obstacle(const ActiveSet& active) const;  // whether any is with an obstacle

  double objective() const { return model_.objective; }
  double energy() const { return energy_; }  // J: objective, springs and loads, over the energy scale [rad²]
  double spring_energy(const std::vector<Position>& mounts, double length) const;  // over the energy scale [rad²]
  double violation() const;                                                        // max(0, -c) over all gaps [mm]
  double stationarity_tolerance(const ActiveSet& active) const;  // of the gradient of the Lagrangian [rad²]
  double energy_scale() const { return robot_.energy_scale(model_.segment_length() * robot_.segments); }
  const std::vector<State>& states() const { return model_.states; }
  const std::vector<Frame>& frames() const { return model_.frames; }
  const std::vector<Position>& points() const {  // by line and position [mm]
    place_all();
    return points_;
  }
  // Contacts within reach, and the gap of every contact, infinite out of reach [mm].
  const std::vector<int>& near_contacts() const { return near_; }
  const std::vector<double>& gaps() const { return gaps_; }
  double farthest_line() const { return farthest_line_; }    // distance of a line of points from the backbone [mm]
  bool out_of_reach(int obstacle, double motion) const;      // of all points, even after such a motion
  void all_gaps(double* gaps) const;                         // of every contact, within reach or not
  Gap<kSpace> gap(int contact) const;                        // with derivatives in the point
  Force force(int contact, const Position& on_point) const;  // on the nodes, equivalent to one on the point
  Slope slope(int contact) const;

  // How points, gaps and loads change with parameters; these follow lagrangian_hessian. Motions of an obstacle are its
  // shifts along the axes, its turns about its centre, and its growth.
  static constexpr int kMotions = kSpace + Model::kTurn + 1;
  Position velocity(int contact, const std::vector<State>& rates) const;  // of its point, where nodes move at rates
  // Adds the change of -λ∇c in the lower state beside a point between nodes, where the upper state moves by itself.
  void add_coupling(int contact, double multiplier, std::vector<InputSlope<Model>>& segments) const;
  GapRate<kSpace> gap_rate(int contact, int motion, const Gap<kSpace>& gap) const;
  // Adds the slope of the loads in the length to that of the Lagrangian in the states of the nodes; `forces` is
  // scratch.
  void add_load_growth(std::vector<State>& node_slopes, std::vector<State>& forces) const;
  void input_slopes(const Iterate& at, int inputs, InputSlopes<Model>& slopes) const {
    model_.input_slopes(at.command, at.controls, inputs, slopes);
  }
  int disk_segment(int contact) const { return (contact - first_disk_contact()) / std::max(1, Model::kDiskSides); }
  LengthSlope<Control> disk_length_slope(int contact) const requires(Model::kRod) {
    return model_.disk_length_slope(disk_segment(contact),
                                    (contact - first_disk_contact()) % std::max(1, Model::kDiskSides));
  }

  int mounts() const { return static_cast<int>(springs_.size()); }
  int mount(int contact) const { return contact >= contacts() ? -1 : mount_of_[contact / points_.size()]; }
  int mount_of(int obstacle) const { return mount_of_[obstacle]; }
  const Mat<kSpace, kSpace>& spring(int mount) const { return springs_[mount]; }  // stiffness over the energy scale
  const std::vector<Position>& mount_gradient() const { return mount_gradient_; }
  double taken(int cable) const {  // length that the bending takes up from a cable of a rod [mm]
    if constexpr (Model::kRod) return model_.cables().slack(cable, 0);
    return 0;
  }
  int slack_contact(int cable) const { return contacts() + cable; }
  bool is_slack(int contact) const { return contact >= contacts() && contact < first_disk_contact(); }
  int first_disk_contact() const { return contacts() + (Model::kRod ? static_cast<int>(robot_.rod.cables.size()) : 0); }
  bool has_loads() const { return robot_.loaded(); }
  bool has_free_form() const { return model_.has_free_form(); }  // of the shape of the robot that nothing touches
  double lever_arm(int contact) const;                           // approximate derivative of the gap in a control [mm]
  const std::vector<Control>& gradient() const { return model_.gradient; }

 private:
  bool is_evaluated(const Iterate& at) const {
    const auto same = [](const auto& a, const auto& b) { return a.v == b.v; };
    return evaluated_ && std::equal(controls_.begin(), controls_.end(), at.controls.begin(), same) &&
           command_ == at.command && std::equal(displacements_.begin(), displacements_.end(), at.mounts.begin(), same);
  }

  // Location of a point: a fraction of the way from a node to the next, on a line across the disks.
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
  // Loads of a rod: their work, their forces on the nodes, and the Hessian of that work, all over the energy scale.
  template <class Each>
  void each_load(Each each) const;
  double load_work();
  double kept_work();
  void add_loads(std::vector<State>& node_forces) const;
  void add_load_curvature(System& system) const;
  void add_barrier(const std::vector<Control>& controls);
  void update_springs(const std::vector<Position>& mounts);
  void measure_gaps();
  void place_obstacles(double part);
  // Those of a shape are placed where they are looked at: most are out of reach of all obstacles.
  void place_all() const;
  void measure_slacks_and_disks(const Command& command) requires(Model::kRod);
  void push_disks(const ActiveSet& active) requires(Model::kRod);
  DiskGap disk_gap(int contact) const requires(Model::kRod) {
    return model_.disk_gap(disk_segment(contact), (contact - first_disk_contact()) % Model::kDiskSides);
  }

  Robot robot_;
  Model model_;
  std::span<const Obstacle> obstacles_;
  std::span<const Obstacle> origins_, towards_;  // of moving obstacles: where they come from and go to
  std::span<const double> motions_;
  double largest_motion_ = 0;
  double part_ = 0;                // of the way, where they are
  std::vector<Obstacle> passing_;  // there
  double farthest_line_ = 0;       // distance of a line of points from the backbone
  double reach_ = 0;               // distance of a node from an obstacle within which its points are measured
  double energy_ = 0;
  bool evaluated_ = false;         // whether all is that of
  Command command_{};              // this command,
  std::vector<Control> controls_;  // these controls, and the displacements of the mounts
  bool has_gradient_ = false;      // whether the gradient is that of the same, and
  ActiveSet pressed_;              // these multipliers
  double loaded_ = 1;              // part of the loads that act
  double load_slope_ = 0;          // bound on the slope of their work in a control
  bool keeps_tensions_ = false;    // whether any motor keeps
  Tensions kept_tensions_;         // this tension, infinite for those that hold a length, and
  Tensions kept_multipliers_{};    // the same over the energy scale, 0 for them
  double kept_slope_ = 0;          // bound on the slope of their work in a control
  bool barrier_enabled_ = false;
  double barrier_energy_ = 0;
  std::vector<Control> barrier_slope_;  // of each segment
  std::vector<Mat<Model::kControl, Model::kControl>> barrier_curvature_;
  std::vector<Position> origin_;        // nodes of the shape of the broad phase
  std::vector<Position> mount_origin_;  // mounts of that shape
  std::vector<double> clear_;           // of each obstacle: motion of the nodes before it is within reach
  double drift_ = 0;                    // largest motion of a node from that shape
  std::vector<Position> nodes_;
  mutable std::vector<Position> points_;
  mutable bool all_placed_ = false;
  std::vector<Site> sites_;  // of the points
  std::vector<double> gaps_;
  std::vector<int> near_;
  std::vector<int> mount_of_;                 // of each obstacle, -1 for a fixed one
  std::vector<Mat<kSpace, kSpace>> springs_;  // of the mounts
  std::vector<Position> displacements_;       // of the mounts
  std::vector<Position> mount_gradient_;
  std::vector<State> node_forces_;  // Σ λ ∇c at each node
};

}  // namespace ccr
