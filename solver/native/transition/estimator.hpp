// Estimates of the contact force of many robots, as factors on the forces of the nominal model.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "transition/actuation.hpp"
#include "transition/arrays.hpp"
#include "transition/laws.hpp"

namespace ccr {

// Where the slopes of the free tip are from, for the estimate by eq. 11.
enum class TipSlopes { kFitted, kBlock, kDifferences };

struct EstimatorSettings {
  Actuation actuation;
  bool learns;      // whether the rigidity is unknown, and learnt from robots that nothing touches
  bool by_contact;  // whether the estimate that is observed is `contact`, otherwise `paper`
  bool alike;       // whether a single companion is pulled less by all commands in proportion
  bool pairs;       // whether displacements of cables are signed: pairs of the paper's model in space
  TipSlopes tip;
  std::vector<double> fitted;  // slopes of Fig. 7, (3,)
  double friction;             // μ of eq. 11
  double travel_mm;            // a
  double step_mm;              // of a command, for differences
  double least_slope;          // of a contact's motion against its force
  double tension_noise;        // that the rigidity is learnt with [N]
  int between;                 // points of a line between two nodes
};

// What is known of one robot, in numbers or duals.
template <class T>
struct Measured {
  const T* block;        // equilibrium of the nominal robot
  const T* actuated;     // coordinates that the encoders read [mm]
  const T* tensions;     // of the cables, that the motors see, (cables) [N]
  const double* onsets;  // those at the onset of the present contact, signed as displacements of pairs [N]
  const T* free;         // blocks of the free robot and its companions; none where no motion is needed
};

// What is estimated of one robot.
template <class T>
struct Estimate {
  T chosen = 0, paper = 0;                                              // factors on the nominal forces
  T free_forces[Actuation::kMost] = {}, levers[Actuation::kMost] = {};  // per command
};

// State of N robots, and what is estimated of them.
struct EstimatorArrays {
  RowsOf<double> chosen, paper;        // factors on the nominal forces
  RowsOf<double> free_forces, levers;  // (commands)
  RowsOf<double> products, squares;    // of the fit of the rigidity
  RowsOf<const double> lines_mm;       // where the lines cross the disks, (lines, D − 1)
};

template <int D>
class Estimator {
 public:
  // `free` holds 1 + companions rows for each robot; without a batch where no motion is needed. `layout` is that of the
  // blocks of the model.
  Estimator(EstimatorSettings settings, const BlockLayout& layout, int count, BatchArrays<D> free,
            EstimatorArrays arrays);

  template <class T>
  bool touches(const T* block) const {
    const T* flags = block + layout_.flags.offset;
    return std::any_of(flags, flags + layout_.flags.size, [](const T& flag) { return value_of(flag) != 0; });
  }
  // Whether the estimate takes the slopes of the free tip from a block.
  bool takes_tip_slopes() const { return settings_.tip == TipSlopes::kBlock; }
  // Whether the free robots of a robot in this equilibrium must be moved to their commands before it is estimated.
  bool moves_free(const double* block) const { return free_.batch && touches(block); }
  int companions() const { return companions_; }
  int count() const { return count_; }
  const Actuation& actuation() const { return settings_.actuation; }
  const BlockLayout& layout() const { return layout_; }
  const BlockLayout& free_layout() const { return free_layout_; }
  const BatchArrays<D>& free() const { return free_; }
  int free_row(int robot) const { return (companions_ + 1) * robot; }
  const double* free_block(int robot) const { return free_.batch ? free_.blocks[free_row(robot)] : nullptr; }
  double chosen(int robot) const { return *arrays_.chosen[robot]; }
  double paper(int robot) const { return *arrays_.paper[robot]; }
  const double* free_forces(int robot) const { return arrays_.free_forces[robot]; }
  const double* levers(int robot) const { return arrays_.levers[robot]; }

  // Tension of a cable with the sign of its displacement.
  template <class T>
  T signed_tension(const T* block, int cable, const T& tension) const {
    return settings_.pairs && block[layout_.cables.offset + cable] < 0 ? -tension : tension;
  }

  // Writes the commands of free robots where something touches the model; else puts them where it is.
  void prepare(int robot, const double* block, const double* actuated) const;
  bool move(int thread, int robot, SlopeTable& slopes) const;
  // Writes the commands of a free robot and its companions to rows of a table.
  template <class T>
  void write_commands(const T* actuated, RowsOf<T> rows) const;

  // What is estimated of a robot; free robots that are to be moved have been.
  template <class T>
  Estimate<T> estimate(int robot, const Measured<T>& measured) const;
  // Estimates anew, keeps it, and learns from it.
  void update(int robot, const Measured<double>& measured) const;
  // The factor that is observed where robot and free robots are elsewhere.
  double factor(int robot, const Measured<double>& measured) const;

 private:
  // Works of the model's forces per command, and their sizes added over the obstacles.
  template <class T>
  struct Pressing {
    T works[Actuation::kMost] = {}, size = 0;
  };
  template <class T>
  using Steps = T[Actuation::kMost * Actuation::kMost];

  template <class T>
  void steps(const T* actuated, T* to) const;
  void copy_state(const double* block, double* free) const;
  template <class T>
  std::array<T, D> point(const T* free, const double* lines, int line, int at) const;
  // Slope per command from how far the companions have moved along an axis.
  template <class T>
  T slope(const T* moved, const T* steps, int command) const;
  template <class T>
  Pressing<T> pressing(int robot, const T* block, const T* steps, const T* free) const;
  template <class T>
  T contact_factor(int robot, const T* tensions, const T* free, const Pressing<T>& pressing) const;
  template <class T>
  T paper_factor(const Measured<T>& measured, const T* tensions, const T* steps) const;
  template <class T>
  T tip_factor(const Measured<T>& measured, const T* loads, const T* steps) const;
  void learn(int robot, const Measured<double>& measured) const;

  EstimatorSettings settings_;
  BlockLayout layout_, free_layout_;
  BatchArrays<D> free_;
  EstimatorArrays arrays_;
  int count_, companions_, nodes_, lines_, positions_, obstacles_;
};

}  // namespace ccr
