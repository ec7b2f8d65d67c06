// Derivatives of an equilibrium in its parameters, by the implicit function theorem at its active set: one
// factorisation of the KKT system, and one right-hand side for each parameter.
#pragma once

#include <array>
#include <vector>

#include "solve/active_set_qp.hpp"
#include "solve/contact_problem.hpp"
#include "solve/kkt_system.hpp"

namespace ccr {

// Numbers of a row: slopes of the node poses, in space also of the rotations of the disks about the base frame's axes;
// then of multipliers, tensions, forces of the obstacles and their displacements, as fields of a block.
template <class Model>
struct SlopeRow {
  SlopeRow(int segments, int contacts, int cables, int obstacles)
      : nodes(3 * (segments + 1)),
        turns(Model::kSpace == 3 ? nodes : 0),
        contacts(contacts),
        cables(cables),
        forces(Model::kSpace * obstacles) {}
  int size() const { return nodes + turns + contacts + cables + 2 * forces; }

  int nodes, turns, contacts, cables, forces;
};

// What an equilibrium is differentiated in beside its cables, and whether the slope of the gap of a contact, or of
// none, ends each row.
struct SlopeRequest {
  bool length = true, obstacles = false;
  bool gap = false;
  int contact = -1;
};

// The parameters are the displacement of each cable, the length, and of each obstacle its motions: shifts, turns about
// its centre, growth. The Hessian has no penalty and no damping; its eigenvalues may have any sign.
template <class Model>
class Slopes {
 public:
  using ContactProblem = ccr::ContactProblem<Model>;
  using Iterate = ccr::Iterate<Model>;
  static constexpr int kMotions = ContactProblem::kMotions;

  Slopes(int segments, int mounts);
  // Writes a row for each parameter that is asked for, at an equilibrium at which the problem has its gradient, while
  // the gaps in `held` stay closed. Leaves out those that the others imply, whose multipliers keep still, and returns
  // their number; -1 where the Hessian is singular, or gaps all but depend on each other, as those of cables that lock
  // a robot.
  int differentiate(const ContactProblem& problem, const Iterate& at, const ActiveSet& held,
                    const SlopeRequest& request, double* rows);

  // Of the last call that found slopes, along a motion of the cables: the slope of the multiplier of a gap that was
  // held, or 0 where others imply it; and the slope of the gap of a contact that was not.
  double multiplier_along(int contact, const Vec<Model::kCables>& motion) const;
  double gap_along(const ContactProblem& problem, int contact, const Vec<Model::kCables>& motion) const;

 private:
  static constexpr int kSpace = Model::kSpace, kInputs = Model::kInputs, kCables = Model::kCables;
  using Position = ccr::Position<kSpace>;
  using State = typename Model::State;
  using Control = typename Model::Control;
  using Direction = ccr::Direction<Model>;
  using KktSystem = ccr::KktSystem<Model>;
  using Multipliers = typename ActiveSetQp<Model>::Multipliers;

  // A contact that presses or is held.
  struct Touch {
    int contact, obstacle, mount;
    double multiplier;
    int held;  // index among the held gaps, -1 if it is not held
    Gap<kSpace> gap;
  };

  // What changes with an input of the segment laws at fixed controls, mounts and multipliers.
  struct Input {
    std::vector<State> moved;        // states of the nodes
    std::vector<State> node_slopes;  // slope of the Lagrangian in these,
    std::vector<Control> gradient;   // in the controls
    std::vector<Position> mounts;    // and in the mounts
    Multipliers gaps;                // of the held gaps
  };

  // The right-hand side of a parameter, and its solution.
  struct Row {
    Row(int segments, int mounts) : response(segments, mounts) {}
    int parameter;
    int input, obstacle;                // -1 for none
    Vec<kCables> tensions;              // slopes of the Lagrangian's slopes in the cables, at fixed unknowns
    std::vector<GapRate<kSpace>> gaps;  // of each touching contact, by the motion of its obstacle
    std::vector<typename Model::System::Force> forces;
    Direction response;
    Multipliers changes;  // of the held gaps, then of their multipliers
  };

  bool factor(const ContactProblem& problem, const Iterate& at, const ActiveSet& held);
  void find_touches(const ContactProblem& problem, const Iterate& at);
  void find_input(const ContactProblem& problem, const Iterate& at, int number);
  void move_nodes(const std::vector<InputSlope<Model>>& laws, Input& input) const;
  void pull_back(const std::vector<InputSlope<Model>>& laws, Input& input) const;
  void add_own_gaps(const ContactProblem& problem, const ActiveSet& active, Input& input) const;
  void find_within();
  void add_cable_rows(int contacts, int cables);
  void add_input_row(int parameter, int input);
  void add_obstacle_row(const ContactProblem& problem, int obstacle, int motion, int first);
  Row& add_row(int parameter, int input, int obstacle);
  void respond();
  void finish(const ContactProblem& problem, const Iterate& at, Row& row, double* to) const;
  double gap_slope(const ContactProblem& problem, int contact, const Row& row) const;
  void add_own_motion(const ContactProblem& problem, int contact, double* slopes, int size) const;
  double tension_slope(const Row& row, int cable) const;
  void write_forces(const ContactProblem& problem, const Row& row, double* to) const;

  int segments_, mounts_;
  int cables_ = 0;
  int asked_ = 0;       // number of the inputs that are asked for
  bool still_ = false;  // whether no parameter moves a control: of a robot of the paper's models that nothing touches
  int reach_ = 0;       // the segment from which on the nodes' states have no part in the Hessian
  KktSystem kkt_;
  ActiveSetQp<Model> qp_;
  InputSlopes<Model> laws_;
  std::array<Input, kInputs> inputs_;
  Mat<kInputs, kInputs> within_;  // second derivatives of the Lagrangian in the inputs, at fixed controls
  ActiveSet held_;                // the gaps that stay closed
  std::vector<Touch> touches_;
  std::vector<State> load_forces_;  // scratch
  std::vector<Row> rows_;
  int used_ = 0;  // of the rows
  std::vector<typename KktSystem::Forcing> forcings_;
};

}  // namespace ccr
