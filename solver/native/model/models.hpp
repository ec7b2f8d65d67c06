// The models that the solver is compiled for.
#pragma once

#include "model/planar.hpp"
#include "model/spatial_paper.hpp"
#include "model/spatial_rod.hpp"

#define CCR_EACH_MODEL(DO) \
  DO(ccr::PlanarPaper)     \
  DO(ccr::PlanarRod)       \
  DO(ccr::SpatialPaper)    \
  DO(ccr::SpatialRod)
