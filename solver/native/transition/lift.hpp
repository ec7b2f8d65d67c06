// Blocks of equilibria in duals: their numbers with slopes in a few inputs, from slopes in the command.
#pragma once

#include "transition/arrays.hpp"
#include "transition/dual.hpp"

namespace ccr {

// The block of an equilibrium whose command has these slopes, of each cable and of the length if it is commanded. Where
// slopes were not found all are zero. Tip slopes, coordinates and trends have none.
template <int D, int P>
void lift(const BlockLayout& layout, const double* block, SlopeTable& table, int robot, const Dual<P>* command,
          Dual<P>* to) {
  for (std::size_t k = 0; k < layout.size; ++k) to[k] = Dual<P>(block[k]);
  if (table.kind(robot) != SlopeTable::Kind::kFound) return;
  const std::size_t nodes = layout.nodes.shape[0], turns = D == 3 ? 3 * nodes : 0;
  const std::size_t cables = layout.cables.size, contacts = layout.multipliers.size, forces = layout.forces.size;
  std::vector<double> turned(turns * P);
  for (int row = 0; row < table.commands(); ++row) {
    const double* slopes = table.rows(robot) + table.width() * row;
    const auto add = [&](const BlockField& field, std::size_t size) {
      for (std::size_t k = 0; k < size; ++k)
        for (int p = 0; p < P; ++p) to[field.offset + k].slopes[p] += slopes[k] * command[row].slopes[p];
      slopes += size;
    };
    add(layout.nodes, 3 * nodes);
    for (std::size_t k = 0; k < turns; ++k)
      for (int p = 0; p < P; ++p) turned[P * k + p] += slopes[k] * command[row].slopes[p];
    slopes += turns;
    add(layout.multipliers, contacts);
    add(layout.tensions, cables);
    add(layout.forces, forces);
    add(layout.displacements, layout.displacements.size);
    add(layout.clearance, 1);
    const std::size_t at = row < static_cast<int>(cables) ? layout.cables.offset + row : layout.length.offset;
    to[at].slopes = command[row].slopes;
  }
  for (std::size_t k = 0; k < forces; ++k)
    to[layout.force.offset + k % D] += Dual<P>::of(0, 1, to[layout.forces.offset + k]);
  for (std::size_t node = 0; node < nodes; ++node) {
    Dual<P>* axes = to + layout.frames.offset + (D == 2 ? 2 : 9) * node;
    if constexpr (D == 2) {  // a direction that turns with the angle of the disk
      const Dual<P>& angle = to[layout.nodes.offset + 3 * node + 2];
      axes[0].add(-axes[1].value, angle);
      axes[1].add(axes[0].value, angle);
    } else {
      for (int p = 0; p < P; ++p) {
        double turn[3];
        for (int d = 0; d < 3; ++d) turn[d] = turned[P * (3 * node + d) + p];
        for (int d = 0; d < 3; ++d)
          for (int column = 0; column < 3; ++column) {
            const int e = (d + 1) % 3, f = (d + 2) % 3;
            axes[3 * d + column].slopes[p] =
                turn[e] * axes[3 * f + column].value - turn[f] * axes[3 * e + column].value;
          }
      }
    }
  }
}

}  // namespace ccr
