// Equilibria read from blocks and written to them, by the fields of the layout, and how exact they are.
#include <algorithm>
#include <cmath>

#include "model/models.hpp"
#include "solve/model_continuation.hpp"

namespace ccr {

using namespace tolerances;

namespace {

// By loops, which for so few numbers are faster than the calls that copies become.
template <std::size_t N>
const double* read(const double* from, std::array<double, N>& numbers, std::size_t count = N) {
  for (std::size_t k = 0; k < count; ++k) numbers[k] = *from++;
  return from;
}

template <std::size_t N>
double* write(const std::array<double, N>& numbers, double* to, std::size_t count = N) {
  for (std::size_t k = 0; k < count; ++k) *to++ = numbers[k];
  return to;
}

void add_contact(ActiveSet& active, int contact, double multiplier) {
  if (active.count == kMaxActive) return;
  active.contact[active.count] = contact;
  active.multiplier[active.count++] = multiplier;
}

}  // namespace

template <class Model>
void ModelContinuation<Model>::read_block(const double* block) {
  read(block + layout_.cables.offset, present_.command.cables.v, layout_.cables.size);
  present_.command.length = block[layout_.length.offset];
  read(block + layout_.tensions.offset, tensions_.v, layout_.cables.size);
  const double* coordinates = block + layout_.coordinates.offset;
  for (Control& control : present_.controls) coordinates = read(coordinates, control.v);
  const double* nodes = block + layout_.nodes.offset;
  for (Position& node : nodes_) {
    for (int k = 0; k < kSpace; ++k) node[k] = nodes[k];
    nodes += 3;
  }
  const double* frames = block + layout_.frames.offset;
  for (Frame& frame : frames_) frames = read(frames, frame.v);
  read_mounts(block + layout_.displacements.offset, present_.mounts);
  mounts_ = present_.mounts;
  energy_ = block[layout_.objective.offset] + problem_.spring_energy(present_.mounts, present_.command.length);
  problem_.update_broadphase(nodes_, present_.mounts);
  place_points<Model>(problem_.robot(), nodes_, frames_, points_);
  read(block + layout_.onset.offset, onset_.v, layout_.cables.size);
  read_active_set(block);
  present_.command.loads = 1;
  present_.command.scene = problem_.is_moving() ? 0 : 1;
  present_evaluated_ = false;
  if (problem_.has_loads()) evaluate_present();  // for the energy
  began_in_contact_ = problem_.touches_obstacle(present_.active);
  if (!keeps_trend()) return clear_trend();
  const double* trend = block + layout_.trend_coordinates.offset;
  for (Control& control : trend_.controls) trend = read(trend, control.v);
  read_mounts(block + layout_.trend_displacements.offset, trend_.mounts);
  read(block + layout_.trend_multipliers.offset, trend_.multipliers);
}

// A contact is active where its point touches and its multiplier is positive.
template <class Model>
void ModelContinuation<Model>::read_active_set(const double* block) {
  ActiveSet& active = present_.active;
  active.count = 0;
  const int points = static_cast<int>(points_.size());
  const double *flags = block + layout_.flags.offset, *multipliers = block + layout_.multipliers.offset;
  if (Model::kRod)
    for (int k = 0; k < static_cast<int>(layout_.cables.size); ++k)
      if (tensions_[k] > 0)  // first, as a robot that they hold need not be stable without them
        add_contact(active, problem_.slack_contact(k),
                    tensions_[k] / problem_.robot().energy_scale(present_.command.length));
  if (std::find(flags, flags + points, 1.0) != flags + points)
    for (int c = 0; c < problem_.contacts(); ++c)
      if (flags[c % points] != 0 && multipliers[c] > 0 && active.count < kMaxActive)
        add_contact(active, c, multipliers[c]);
  if (!Model::kRod) return;
  const double* disks = block + layout_.disk_multipliers.offset;
  for (int i = 0; i < problem_.robot().segments; ++i)
    if (disks[i] != 0)
      add_contact(active, problem_.first_disk_contact() + Model::kDiskSides * i + (disks[i] < 0), std::abs(disks[i]));
}

template <class Model>
void ModelContinuation<Model>::read_mounts(const double* displacements, std::vector<Position>& mounts) const {
  const int obstacles = static_cast<int>(problem_.obstacles().size());
  for (int j = 0; j < obstacles; ++j, displacements += kSpace)
    if (const int mount = problem_.mount_of(j); mount >= 0) std::copy_n(displacements, kSpace, mounts[mount].v.begin());
}

template <class Model>
void ModelContinuation<Model>::write_block(double* block) {
  write(present_.command.cables.v, block + layout_.cables.offset, layout_.cables.size);
  block[layout_.length.offset] = present_.command.length;
  write(tensions_.v, block + layout_.tensions.offset, layout_.cables.size);
  block[layout_.objective.offset] = problem_.objective();
  double* coordinates = block + layout_.coordinates.offset;
  for (const Control& control : present_.controls) coordinates = write(control.v, coordinates);
  double* nodes = block + layout_.nodes.offset;
  for (const auto& state : problem_.states()) nodes = write(state.v, nodes, 3);
  double* frames = block + layout_.frames.offset;
  for (const Frame& frame : problem_.frames()) frames = write(frame.v, frames);
  write_active_set(block);
  double* gaps = block + layout_.gaps.offset;
  problem_.all_gaps(gaps);
  block[layout_.clearance.offset] = lowest(problem_.contacts(), [&](int c) { return gaps[c]; });
  write_mounts(present_.mounts, block + layout_.displacements.offset);
  write_forces(block);
  write(onset_.v, block + layout_.onset.offset, layout_.cables.size);
  write(problem_.free_slopes(present_.command).v, block + layout_.tip_slopes.offset, layout_.tip_slopes.size);
  if (keeps_trend()) write_trend(block);
}

template <class Model>
void ModelContinuation<Model>::tip_slopes(const double* command, double* to) {
  Command at = present_.command;
  read(command, at.cables.v, layout_.cables.size);
  at.length = command[layout_.cables.size];
  write(problem_.free_slopes(at).v, to, layout_.tip_slopes.size);
}

template <class Model>
void ModelContinuation<Model>::write_forces(double* block) const {
  double* forces = block + layout_.forces.offset;
  Position total{};
  for (int j = 0; j < static_cast<int>(problem_.obstacles().size()); ++j) {
    const Position force = problem_.contact_force(present_.active, j);
    total += force;
    forces = write(force.v, forces);
  }
  write(total.v, block + layout_.force.offset);
}

template <class Model>
void ModelContinuation<Model>::write_active_set(double* block) const {
  const ActiveSet& active = present_.active;
  const int points = static_cast<int>(points_.size());
  double *multipliers = block + layout_.multipliers.offset, *flags = block + layout_.flags.offset;
  double* disks = block + layout_.disk_multipliers.offset;
  std::fill_n(multipliers, problem_.contacts(), 0.0);
  std::fill_n(flags, points, 0.0);
  for (int j = 0; j < active.count; ++j)
    if (active.contact[j] < problem_.contacts()) {
      multipliers[active.contact[j]] = active.multiplier[j];
      flags[active.contact[j] % points] = 1;
    }
  if (!Model::kRod) return;
  std::fill_n(disks, problem_.robot().segments, 0.0);
  for (int j = 0; j < active.count; ++j)
    if (const int disk = active.contact[j] - problem_.first_disk_contact(); disk >= 0)
      disks[disk / std::max(1, Model::kDiskSides)] =
          disk % std::max(1, Model::kDiskSides) == 0 ? active.multiplier[j] : -active.multiplier[j];
}

template <class Model>
void ModelContinuation<Model>::write_trend(double* block) const {
  const ActiveSet& active = present_.active;
  double* controls = block + layout_.trend_coordinates.offset;
  for (const Control& control : trend_.controls) controls = write(control.v, controls);
  write_mounts(trend_.mounts, block + layout_.trend_displacements.offset);
  double* multipliers = block + layout_.trend_multipliers.offset;
  std::fill_n(multipliers, kMaxTrend, 0.0);
  if (active.count > kMaxTrend) return;
  const auto begin = active.contact.begin(), end = begin + active.count;
  for (int j = 0; j < active.count; ++j) {
    const auto rank = std::count_if(begin, end, [&](int contact) { return contact < begin[j]; });
    multipliers[rank] = trend_.multipliers[j];
  }
}

template <class Model>
void ModelContinuation<Model>::write_mounts(const std::vector<Position>& mounts, double* displacements) const {
  for (int j = 0; j < static_cast<int>(problem_.obstacles().size()); ++j)
    displacements = write(problem_.mount_of(j) < 0 ? Position{}.v : mounts[problem_.mount_of(j)].v, displacements);
}

template <class Model>
Optimality ModelContinuation<Model>::optimality(const double* block) {
  read_block(block);
  evaluate_present();
  Optimality found;
  const double length = problem_.robot().max_length;
  for (const auto& g : problem_.gradient())
    for (const double slope : g.v) found.stationarity = std::max(found.stationarity, std::abs(slope));
  for (const auto& g : problem_.mount_gradient())
    found.stationarity = std::max(found.stationarity, length / problem_.robot().segments * norm(g));
  found.gap = problem_.violation() / length;
  for (int j = 0; j < present_.active.count; ++j) {
    const double gap = std::abs(problem_.gaps()[present_.active.contact[j]]);
    found.gap = std::max(found.gap, gap / length);
    found.complementarity = std::max(found.complementarity, gap * present_.active.multiplier[j]);
  }
  return found;
}

template <class Model>
void ModelContinuation<Model>::record_shape() {
  points_ = problem_.points();
  mounts_ = present_.mounts;
  if (!shapes_) return;
  for (const auto& s : problem_.states()) shapes_->insert(shapes_->end(), s.v.begin(), s.v.begin() + 3);
  for (const Position& point : points_) shapes_->insert(shapes_->end(), point.v.begin(), point.v.end());
  for (std::size_t j = 0; j < problem_.obstacles().size(); ++j) {
    const int mount = problem_.mount_of(static_cast<int>(j));
    const Position moved = mount < 0 ? Position{} : mounts_[mount];
    shapes_->insert(shapes_->end(), moved.v.begin(), moved.v.end());
  }
}

#define CCR_INSTANTIATE(Model)                                                \
  template Optimality ModelContinuation<Model>::optimality(const double*);    \
  template void ModelContinuation<Model>::read_block(const double*);          \
  template void ModelContinuation<Model>::write_block(double*);               \
  template void ModelContinuation<Model>::tip_slopes(const double*, double*); \
  template void ModelContinuation<Model>::record_shape();
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
