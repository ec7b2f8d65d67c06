#include "solve/block_layout.hpp"

#include "tolerances.hpp"

namespace ccr {

namespace {

void append(BlockLayout& layout, BlockField& field, std::vector<int> shape) {
  field.offset = layout.size;
  field.size = 1;
  for (const int extent : shape) field.size *= extent;
  field.shape = std::move(shape);
  layout.size += field.size;
}

// The shape of one number, or of several, for each of some things.
std::vector<int> each(int count, std::vector<int> shape) {
  if (shape == std::vector{1}) return {count};
  shape.insert(shape.begin(), count);
  return shape;
}

// Slopes of the free tip in each displacement; none where the model has no closed form of them.
template <class Model>
std::vector<int> tip_shape(int cables) {
  if (cables == 1 || Model::kTip == 0) return {Model::kTip};
  return Model::kRod ? std::vector{0} : std::vector{cables, Model::kTip / cables};
}

}  // namespace

template <class Model>
BlockLayout make_block_layout(const BlockCounts& counts) {
  const int n = counts.segments, cables = counts.cables, space = Model::kSpace, obstacles = counts.obstacles;
  const std::vector<int> contacts = {obstacles, counts.lines, counts.positions};
  const bool trend = cables == 1;
  BlockLayout out;
  append(out, out.cables, {cables});
  append(out, out.length, {1});
  append(out, out.tensions, {cables});
  append(out, out.objective, {1});
  append(out, out.coordinates, each(n, {Model::kControl}));
  append(out, out.nodes, {n + 1, 3});
  append(out, out.frames, space == 2 ? std::vector{n + 1, 2} : std::vector{n + 1, 3, 3});
  append(out, out.multipliers, contacts);
  append(out, out.gaps, contacts);
  append(out, out.displacements, {obstacles, space});
  append(out, out.forces, {obstacles, space});
  append(out, out.force, {space});
  append(out, out.clearance, {1});
  append(out, out.onset, {cables});
  append(out, out.tip_slopes, tip_shape<Model>(cables));
  append(out, out.flags, {counts.lines * counts.positions});
  append(out, out.disk_multipliers, {Model::kRod ? n : 0});
  append(out, out.trend_coordinates, each(trend ? n : 0, {Model::kControl}));
  append(out, out.trend_displacements, {trend ? obstacles : 0, space});
  append(out, out.trend_multipliers, {trend ? tolerances::kMaxTrend : 0});
  return out;
}

BlockLayout make_block_layout(ModelKind model, const BlockCounts& counts) {
  switch (model) {
    case ModelKind::kPlanarPaper: return make_block_layout<PlanarPaper>(counts);
    case ModelKind::kPlanarRod: return make_block_layout<PlanarRod>(counts);
    case ModelKind::kSpatialPaper: return make_block_layout<SpatialPaper>(counts);
    default: return make_block_layout<SpatialRod>(counts);
  }
}

std::vector<BlockField> BlockLayout::fields() const {
  return {cables,
          length,
          tensions,
          objective,
          coordinates,
          nodes,
          frames,
          multipliers,
          gaps,
          displacements,
          forces,
          force,
          clearance,
          onset,
          tip_slopes,
          flags,
          disk_multipliers,
          trend_coordinates,
          trend_displacements,
          trend_multipliers};
}

#define CCR_INSTANTIATE(Model) template BlockLayout make_block_layout<Model>(const BlockCounts&);
CCR_EACH_MODEL(CCR_INSTANTIATE)
#undef CCR_INSTANTIATE

}  // namespace ccr
