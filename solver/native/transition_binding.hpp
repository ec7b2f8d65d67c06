// The classes of a transition in the Python module solver._kernel.
#pragma once

#include <nanobind/nanobind.h>

namespace ccr::binding {

// Names of what is bound for the plane and for space.
struct TransitionNames {
  const char *arrays, *estimator, *transition;
};

void bind_transitions(nanobind::module_& m);

}  // namespace ccr::binding
