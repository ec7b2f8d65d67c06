// The models that the solver is compiled for.
#pragma once

#include "model/planar.hpp"
#include "model/spatial.hpp"

#define CCR_EACH_MODEL(DO)  \
  DO(ccr::Planar<PaperLaw>) \
  DO(ccr::Planar<RodLaw>)   \
  DO(ccr::Spatial)
