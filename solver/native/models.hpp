// The models of a robot, for all of which the solver is compiled.
#pragma once

#include "planar.hpp"
#include "spatial.hpp"

#define CCR_EACH_MODEL(DO)     \
  DO(ccr::Planar<UniformCable>) \
  DO(ccr::Planar<SlidingCable>) \
  DO(ccr::Spatial)
