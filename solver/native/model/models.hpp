// The models of a robot, for all of which the solver is compiled.
#pragma once

#include "model/planar.hpp"
#include "model/spatial.hpp"

#define CCR_EACH_MODEL(DO)  \
  DO(ccr::Planar<PaperLaw>) \
  DO(ccr::Planar<RodLaw>)   \
  DO(ccr::Spatial)
