// Robots, obstacles and blocks as Python gives them, checked.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "solve/continuation.hpp"

namespace ccr::binding {

namespace nb = nanobind;

using Input = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using Output = nb::ndarray<double, nb::c_contig, nb::device::cpu>;
using Mask = nb::ndarray<const bool, nb::c_contig, nb::device::cpu>;
using Blocks = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Counts = nb::ndarray<std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Array = nb::ndarray<nb::numpy, double, nb::ndim<1>>;

template <int D>
using Numbers = std::array<double, D>;

// Hands numbers over to Python without copying them.
inline Array to_array(std::vector<double> numbers) {
  auto* const owned = new std::vector<double>(std::move(numbers));
  nb::capsule owner(owned, [](void* held) noexcept { delete static_cast<std::vector<double>*>(held); });
  return Array(owned->data(), {owned->size()}, owner);
}

inline void require(bool condition, const std::string& message) {
  if (!condition) throw std::invalid_argument(message);
}

inline Rod make_rod(const std::vector<Numbers<2>>& holes, const std::vector<int>& ends, const Input& stiffness,
                    const Input& rest, const Numbers<3>& weight, std::vector<Load> loads, double least_pull,
                    double bounded_twist) {
  require(holes.size() == ends.size() && holes.size() <= kMaxCables,
          "holes and ends must name the same cables, at most " + std::to_string(kMaxCables));
  Rod rod{.cables = {},
          .stiffness = {stiffness.data(), stiffness.data() + stiffness.size()},
          .rest = {rest.data(), rest.data() + rest.size()},
          .weight = {weight},
          .loads = std::move(loads),
          .least_pull = least_pull,
          .bounded_twist = bounded_twist};
  for (std::size_t k = 0; k < holes.size(); ++k) rod.cables.push_back({{holes[k]}, ends[k]});
  return rod;
}

// Refuses a rod whose cables, segments or loads do not fit its model.
inline void require_rod(ModelKind model, int segments, const Rod& rod) {
  if (model == ModelKind::kPlanarPaper || model == ModelKind::kSpatialPaper) return;
  const std::size_t numbers = static_cast<std::size_t>(segments) * (model == ModelKind::kPlanarRod ? 1 : 3);
  require(!rod.cables.empty() && rod.stiffness.size() == numbers && rod.rest.size() == numbers,
          "a rod needs a cable, and stiffness and rest of each control of its segments");
  const auto on_robot = [&](int node) { return node >= 1 && node <= segments; };
  for (const Cable& cable : rod.cables) require(on_robot(cable.end), "a cable must end at a node from 1 on");
  for (const Load& load : rod.loads) require(on_robot(load.node), "a load must act on a node from 1 on");
}

inline Robot make_robot(ModelKind model, int segments, double offset, double angle, double rigidity, double max_tension,
                        double max_length, double disk_radius, double disk_thickness,
                        const std::vector<Numbers<2>>& lines, const std::vector<double>& edges, int between,
                        const Rod& rod) {
  require(edges.size() == lines.size() && !lines.empty(),
          "edges must name the longest edge of each line, of one at least");
  require_rod(model, segments, rod);
  std::vector<Vec<2>> on_disk;
  for (const Numbers<2>& line : lines) on_disk.push_back({line});
  return {.model = model,
          .segments = segments,
          .offset = offset,
          .angle = angle,
          .rigidity = rigidity,
          .max_tension = max_tension,
          .max_length = max_length,
          .disk_radius = disk_radius,
          .disk_thickness = disk_thickness,
          .lines = std::move(on_disk),
          .edges = edges,
          .between = between,
          .rod = rod};
}

template <int D>
Position<D> position(const double* numbers) {
  Position<D> out;
  std::copy_n(numbers, D, out.v.begin());
  return out;
}

inline std::array<double, kShapeSize> shape_parameters(const Input& parameters) {
  require(parameters.size() <= kShapeSize, "parameters are more than a shape has, SHAPE_SIZE");
  std::array<double, kShapeSize> out{};
  std::copy_n(parameters.data(), parameters.size(), out.begin());
  return out;
}

template <int D>
Obstacle<D> make_obstacle(Shape shape, const Input& parameters, const Numbers<D>& center, double radius,
                          double min_curvature_radius, double inradius, const std::optional<Input>& outline,
                          const std::optional<Mask>& touchable, const std::optional<Input>& spring,
                          std::uintptr_t law) {
  require((!spring || spring->size() == D * D) && (!outline || outline->size() % D == 0),
          "spring is (d, d), outline (k, d)");
  const bool *first = touchable ? touchable->data() : nullptr, *last = first + (touchable ? touchable->size() : 0);
  Obstacle<D> obstacle{.shape = shape,
                       .parameters = shape_parameters(parameters),
                       .law = reinterpret_cast<Law>(law),
                       .center = {center},
                       .radius = radius,
                       .min_curvature_radius = min_curvature_radius,
                       .inradius = inradius,
                       .outline = {},
                       .touchable = {first, last},
                       .everywhere = std::find(first, last, false) == last,
                       .mounted = spring && spring->data()[0] > 0,
                       .spring = {}};
  for (std::size_t k = 0; outline && k < outline->size(); k += D)
    obstacle.outline.push_back(position<D>(outline->data() + k));
  if (spring) std::copy_n(spring->data(), D * D, obstacle.spring.v.begin());
  return obstacle;
}

// Refuses obstacles that do not say of each point of a robot whether it can touch them, unless all can.
template <int D>
void require_points(const BlockLayout& layout, const std::vector<Obstacle<D>>& obstacles) {
  for (const Obstacle<D>& obstacle : obstacles)
    require((obstacle.touchable.empty() && obstacle.everywhere) || obstacle.touchable.size() == layout.flags.size,
            "touchable must have an entry for each point of the robot, " + std::to_string(layout.flags.size));
}

// Refuses obstacles that are not of the same kinds, and motions of them that are no bounds.
template <int D>
void require_motion(const std::vector<Obstacle<D>>& origins, const std::vector<Obstacle<D>>& towards,
                    const std::vector<double>& motions) {
  require(origins.size() == towards.size() && origins.size() == motions.size() && !motions.empty(),
          "a motion needs obstacles, and as many where they go to, and as many bounds");
  for (std::size_t j = 0; j < origins.size(); ++j) {
    const Obstacle<D>&from = origins[j], &to = towards[j];
    require(from.shape == to.shape && from.mounted == to.mounted && from.outline.size() == to.outline.size(),
            "obstacles may move, not change their kind");
    require(std::isfinite(motions[j]) && motions[j] >= 0, "a bound of a motion is not finite, or negative");
  }
}

// Refuses commands that are not finite, and a length, the last number, that is not positive.
inline void require_command(const double* command, std::size_t cables) {
  for (std::size_t k = 0; k <= cables; ++k)
    require(std::isfinite(command[k]), "a command, or that in the block of an equilibrium, is not finite");
  require(command[cables] > 0, "a length, or that in the block of an equilibrium, is not positive");
}

// Refuses blocks that no robot can have: the kernel needs a finite command, cables and then length as in the layout,
// and a positive length.
inline void require_sound(const BlockLayout& layout, const double* block) {
  require_command(block + layout.cables.offset, layout.cables.size);
}

inline void require_lengths(const std::vector<int>& robots, const std::vector<double>& lengths) {
  const auto sound = [](double length) { return std::isfinite(length) && length > 0; };
  require(lengths.size() == robots.size() && std::all_of(lengths.begin(), lengths.end(), sound),
          "lengths must have a finite and positive number for each robot");
}

}  // namespace ccr::binding
