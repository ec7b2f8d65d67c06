// Observations of many robots: rows of scaled numbers within bounds.
#pragma once

#include <utility>
#include <vector>

#include "transition/arrays.hpp"
#include "transition/sensors.hpp"

namespace ccr {

// Where an entry stands in a row; no column where it is absent.
struct Entry {
  int first = -1, size = 0;
  explicit operator bool() const { return first >= 0; }
};

struct ObserverSettings {
  std::vector<int> source;     // column of the block that each column of a row shows
  std::vector<double> factor;  // that it is multiplied with, 0 where a column is written otherwise
  std::vector<double> low, high;
  std::vector<std::uint8_t> delayed;
  Entry desired_force, force_error, force_est, force_measured, desired_ahead, obstacle, robot, contact, tension,
      free_tension, lever, share, nodes, frames;
  std::vector<Entry> encoders;  // of the cables and of the length
  std::vector<double> encoder_factor, pose_factor;
  std::vector<int> ahead;  // steps ahead at which a moving set-point is shown
  double force_n, tension_n, lever_unit;
};

// What is shown of one robot beside its equilibrium, in numbers or duals.
template <class T>
struct Shown {
  const double* goal;                                  // [N]
  const T *force_est, *regulated;                      // [N]
  const double *obstacle, *robot;                      // scaled already
  const T* encoders;                                   // [mm]
  const double* ahead;                                 // set-points ahead [N]
  const T *contact, *tensions, *free_forces, *levers;  // where sensing is not ideal
  T share;
  std::int64_t time;
};

template <int D>
class Observer {
 public:
  Observer(ObserverSettings settings, const Sensors& sensors, bool vector, bool estimated)
      : settings_(std::move(settings)), sensors_(sensors), vector_(vector), estimated_(estimated) {}

  std::size_t size() const { return settings_.source.size(); }
  const ObserverSettings& settings() const { return settings_; }

  // Writes the observation of a robot as it is now, within bounds or not.
  template <class T>
  void write(int robot, const T* block, const Shown<T>& shown, T* row) const;
  // Delays what comes late in a row, and writes it within bounds.
  void finish(int robot, std::int64_t time, double* row, float* to) const;

 private:
  template <class T>
  void write_forces(int robot, const Shown<T>& shown, T* row) const;
  template <class T>
  void write_known(const Shown<T>& shown, T* row) const;
  template <class T>
  void disturb_pose(int robot, std::int64_t time, T* row) const;
  template <class T>
  void turn_axes(int node, const double* turn, T* row) const;

  ObserverSettings settings_;
  const Sensors& sensors_;
  bool vector_, estimated_;  // whether the set-point is a vector; whether the estimate is regulated
};

}  // namespace ccr
