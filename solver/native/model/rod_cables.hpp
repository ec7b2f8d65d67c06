// The cables of a rod at one trial shape: what its bending takes up from each, with slopes in the controls.
#pragma once

#include <algorithm>
#include <vector>

#include "math/rows.hpp"
#include "model/robot.hpp"

namespace ccr {

// A cable's length depends on the controls of its own segments alone, each by itself.
template <int U>
class RodCables {
 public:
  using Control = Vec<U>;

  RodCables(const std::vector<Cable>& cables, int segments)
      : cables_(cables), minus_slopes_(cables.size(), std::vector<Control>(Rows::room(segments))) {}

  // Switches to other cables, as many as before.
  void set_cables(const std::vector<Cable>& cables) {
    cables_ = cables;
    for (int j = 0; j < count(); ++j)  // beyond its end a cable has no slopes
      std::fill(minus_slopes_[j].begin() + cables_[j].end, minus_slopes_[j].end(), Control{});
  }

  int count() const { return static_cast<int>(cables_.size()); }
  const Cable& operator[](int cable) const { return cables_[cable]; }
  bool spans(int cable, int segment) const { return segment < cables_[cable].end; }

  void clear() {
    taken_ = {};
    multipliers_ = {};
  }
  // Adds what a segment takes up from a cable, and its slope.
  void take(int cable, int segment, double taken, const Control& slope) {
    taken_[cable] += taken;
    for (int k = 0; k < U; ++k) minus_slopes_[cable][segment][k] = -slope[k];
  }

  // The same for all segments of a cable, whose slopes have been written.
  void set_taken(int cable, double taken) { taken_[cable] = taken; }
  Control* minus_slopes(int cable) { return minus_slopes_[cable].data(); }

  // Length taken up by the bending beyond the displacement [mm], and minus its gradient in the controls.
  double slack(int cable, double displacement) const { return taken_[cable] - displacement; }
  const std::vector<Control>& minus_slopes(int cable) const { return minus_slopes_[cable]; }

  // Multipliers of the slacks in the Lagrangian.
  const Vec<kMaxCables>& multipliers() const { return multipliers_; }
  void set_multipliers(const Vec<kMaxCables>& multipliers, std::vector<Control>& gradient) {
    multipliers_ = multipliers;
    for (int j = 0; j < count(); ++j)
      if (multipliers[j] != 0)
        for (int i = 0; i < cables_[j].end; ++i)
          for (int k = 0; k < U; ++k) gradient[i][k] += multipliers[j] * minus_slopes_[j][i][k];
  }

 private:
  std::vector<Cable> cables_;
  Vec<kMaxCables> taken_{}, multipliers_{};
  std::vector<std::vector<Control>> minus_slopes_;
};

}  // namespace ccr
