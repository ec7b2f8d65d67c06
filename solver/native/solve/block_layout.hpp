// Memory layout of an equilibrium block: the one place that fixes the order of its numbers. Python reads it from here.
#pragma once

#include <cstddef>
#include <vector>

#include "model/models.hpp"

namespace ccr {

// A field of the block: `size` numbers from `offset` on, an array of this shape in row-major order.
struct BlockField {
  const char* name;
  std::size_t offset = 0, size = 0;
  std::vector<int> shape = {};
};

// What the sizes of the fields depend on beside the model.
struct BlockCounts {
  int segments;
  int cables;
  int lines, positions;  // of the points that can touch
  int obstacles;
};

struct BlockLayout {
  BlockField cables{"cables"};                // displacements, in the paper's model of space signed [mm]
  BlockField length{"length"};                // of the backbone [mm]
  BlockField tensions{"tensions"};            // [N]
  BlockField objective{"objective"};          // of the robot alone, over the energy scale [rad²]
  BlockField coordinates{"coordinates"};      // controls of each segment
  BlockField nodes{"nodes"};                  // x, y, angle of each node in the plane; x, y, z in space [mm, rad]
  BlockField frames{"frames"};                // of each node: the direction of the cable, in space a rotation matrix
  BlockField multipliers{"multipliers"};      // of each contact, over the energy scale
  BlockField gaps{"gaps"};                    // of each contact, infinite where the point cannot touch [mm]
  BlockField displacements{"displacements"};  // of each obstacle [mm]
  BlockField forces{"forces"};                // of each obstacle on the robot [N]
  BlockField force{"force"};                  // of all obstacles together [N]
  BlockField clearance{"clearance"};          // smallest gap [mm]
  BlockField onset{"onset"};  // tensions where the present contact began, signed as the displacements; else 0 [N]
  BlockField tip_slopes{"tip_slopes"};  // of the free tip in each displacement
  BlockField flags{"flags"};            // 1 for each point in the active set, else 0
  // Rod: multiplier of the disks of each segment that meet, in the plane signed as the angle between them.
  BlockField disk_multipliers{"disk_multipliers"};
  // One cable: change of the equilibrium per millimetre of displacement, from which the next step starts.
  BlockField trend_coordinates{"trend_coordinates"};
  BlockField trend_displacements{"trend_displacements"};
  BlockField trend_multipliers{"trend_multipliers"};  // of the active contacts, in the order of the contacts

  std::size_t size = 0;  // of the block

  // All fields in the order in which they stand in the block.
  std::vector<BlockField> fields() const;
};

template <class Model>
BlockLayout make_block_layout(const BlockCounts& counts);

// The same for a model that is chosen at run time.
BlockLayout make_block_layout(ModelKind model, const BlockCounts& counts);

}  // namespace ccr
