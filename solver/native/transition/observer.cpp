#include "transition/observer.hpp"

#include <algorithm>
#include <cmath>

namespace ccr {

namespace {

template <class V, class T>
void write_entry(const Entry& entry, const V* values, double unit, T* row) {
  for (int k = 0; entry && k < entry.size; ++k) row[entry.first + k] = values[k] / unit;
}

}  // namespace

template <int D>
template <class T>
void Observer<D>::write_forces(int robot, const Shown<T>& shown, T* row) const {
  T measured[D], error[D];
  std::copy_n(shown.regulated, D, measured);
  for (int d = 0; sensors_ && d < D; ++d) measured[d] = sensors_.force(robot, shown.time, d, shown.regulated[d]);
  for (int d = 0; vector_ && d < D; ++d) error[d] = shown.goal[d] - measured[d];
  if (!vector_) error[0] = shown.goal[0] - norm<D>(measured);
  if (sensors_ || estimated_) write_entry(settings_.force_measured, measured, settings_.force_n, row);
  write_entry(settings_.desired_force, shown.goal, settings_.force_n, row);
  write_entry(settings_.force_error, error, settings_.force_n, row);
  write_entry(settings_.force_est, shown.force_est, settings_.force_n, row);
  write_entry(settings_.desired_ahead, shown.ahead, settings_.force_n, row);
}

// What the nominal model and the load cells at the motors tell.
template <int D>
template <class T>
void Observer<D>::write_known(const Shown<T>& shown, T* row) const {
  write_entry(settings_.contact, shown.contact, 1.0, row);
  write_entry(settings_.tension, shown.tensions, settings_.tension_n, row);
  write_entry(settings_.free_tension, shown.free_forces, settings_.tension_n, row);
  write_entry(settings_.lever, shown.levers, settings_.lever_unit, row);
  write_entry(settings_.share, &shown.share, 1.0, row);
}

// Adds the errors of a camera or fibre.
template <int D>
template <class T>
void Observer<D>::disturb_pose(int robot, std::int64_t time, T* row) const {
  const int turns = D == 2 ? 1 : 3;
  for (int node = 0; node < sensors_.nodes; ++node) {
    double error[D + 3];
    for (int k = 0; k < D + turns; ++k) error[k] = sensors_.pose(robot, time, node, k);
    T* place = row + settings_.nodes.first + 3 * node;
    for (int k = 0; k < 3; ++k) place[k] += error[k] * settings_.pose_factor[k];
    if (D == 3) turn_axes(node, error + 3, row);
  }
}

// Turns the axes of a disk by a rotation vector, to first order, and makes them of unit length again.
template <int D>
template <class T>
void Observer<D>::turn_axes(int node, const double* turn, T* row) const {
  for (int k = 0; k < 2; ++k) {
    T *axis = row + settings_.frames.first + 6 * node + 3 * k, turned[3];
    for (int d = 0; d < 3; ++d) {
      const int e = (d + 1) % 3, f = (d + 2) % 3;
      turned[d] = axis[d] + (turn[e] * axis[f] - turn[f] * axis[e]);
    }
    const T length = norm<3>(turned);
    for (int d = 0; d < 3; ++d) axis[d] = turned[d] / length;
  }
}

template <int D>
template <class T>
void Observer<D>::write(int robot, const T* block, const Shown<T>& shown, T* row) const {
  for (std::size_t j = 0; j < size(); ++j) row[j] = block[settings_.source[j]] * settings_.factor[j];
  write_forces(robot, shown, row);
  write_entry(settings_.obstacle, shown.obstacle, 1.0, row);
  write_entry(settings_.robot, shown.robot, 1.0, row);
  if (sensors_) {
    write_known(shown, row);
    disturb_pose(robot, shown.time, row);
  }
  const T* read = shown.encoders;
  const double* factor = settings_.encoder_factor.data();
  for (const Entry& entry : settings_.encoders)
    for (int k = 0; k < entry.size; ++k) row[entry.first + k] = *read++ * *factor++;
}

template <int D>
void Observer<D>::finish(int robot, std::int64_t time, double* row, float* to) const {
  if (sensors_) sensors_.apply_latency(robot, time, settings_.delayed.data(), row, size());
  for (std::size_t j = 0; j < size(); ++j)
    to[j] = static_cast<float>(bounded(row[j], settings_.low[j], settings_.high[j]));
}

#define CCR_INSTANTIATE(D, T) template void Observer<D>::write(int, const T*, const Shown<T>&, T*) const;
#define CCR_INSTANTIATE_SPACE(D) \
  template class Observer<D>;    \
  CCR_INSTANTIATE(D, double)     \
  CCR_INSTANTIATE(D, Dual<2>)    \
  CCR_INSTANTIATE(D, Dual<4>)    \
  CCR_INSTANTIATE(D, Dual<8>)
CCR_INSTANTIATE_SPACE(2)
CCR_INSTANTIATE_SPACE(3)
#undef CCR_INSTANTIATE
#undef CCR_INSTANTIATE_SPACE

}  // namespace ccr
