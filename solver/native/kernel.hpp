// The calls of the module solver._kernel on one robot in one scene.
#pragma once

#include <nanobind/nanobind.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "kernel_input.hpp"

namespace ccr::binding {

// Gaps of points (k, D) to one obstacle and their slopes: value and slope of each.
template <int D>
void measure_gaps(Shape shape, const Input& parameters, const Input& points, const Output& gaps) {
  require(points.size() % D == 0 && D * gaps.size() == (D + 1) * points.size(), "points (k, d) give gaps (k, d + 1)");
  Obstacle<D> obstacle{};
  obstacle.shape = shape;
  obstacle.parameters = shape_parameters(parameters);
  for (std::size_t k = 0; k < points.size() / D; ++k) {
    const Gap<D> gap = measure_gap(obstacle, position<D>(points.data() + D * k));
    double* to = gaps.data() + (D + 1) * k;
    *to = gap.value;
    std::copy_n(gap.slope.v.begin(), D, to + 1);
  }
}

// One robot in one scene.
template <int D>
class Kernel {
 public:
  Kernel(const Robot& robot, std::vector<Obstacle<D>> obstacles)
      : robot_(robot),
        obstacles_(std::move(obstacles)),
        idle_(make()),
        layout_(idle_->layout()),
        parameters_(idle_->parameters()),
        slope_row_(idle_->slope_row()) {}

  std::size_t block_size() const { return layout_.size; }

  std::tuple<Status, int, int> rest(double length, const Output& to) {
    require_size(to.size());
    require(std::isfinite(length) && length > 0, "a length is not finite and positive");
    const Lease continuation(*this);
    const StepResult result = continuation->rest(length, to.data());
    if (result.interrupted) throw nb::python_error();
    return {result.status, result.iterations, result.factorizations};
  }

  std::tuple<Status, int, int> step(const Input& from, const std::vector<double>& command, const Output& to) {
    require_block(from);
    require_size(to.size());
    require_target(command);
    const Lease continuation(*this);
    const StepResult result = continuation->follow(from.data(), command.data(), to.data());
    if (result.interrupted) throw nb::python_error();
    return {result.status, result.iterations, result.factorizations};
  }

  std::tuple<Status, int, int, double> move(const Input& from, const std::vector<double>& command,
                                            const std::vector<Obstacle<D>>& origins,
                                            const std::vector<Obstacle<D>>& towards, const std::vector<double>& motions,
                                            const Output& to) {
    require_block(from);
    require_size(to.size());
    require_target(command);
    for (const auto* scene : {&origins, &towards}) {
      require(scene->size() == obstacles_.size(), "the scenes must have as many obstacles as that of the solver");
      require_points(layout_, *scene);
    }
    require_motion(origins, towards, motions);
    const Lease continuation(*this);
    continuation->set_obstacles(origins);
    const StepResult result = continuation->move(from.data(), command.data(), towards, motions, to.data());
    continuation->set_obstacles(obstacles_);
    if (result.interrupted) throw nb::python_error();
    return {result.status, result.iterations, result.factorizations, result.scene};
  }

  std::tuple<Array, Reason> trace(const Input& from, const std::vector<double>& command) {
    require_block(from);
    require_target(command);
    std::vector<double> shapes, to(block_size());
    const Lease continuation(*this);
    const StepResult result = continuation->trace(from.data(), command.data(), to.data(), shapes);
    if (result.interrupted) throw nb::python_error();
    return {to_array(std::move(shapes)), result.reason};
  }

  std::tuple<int, int> slopes_shape() const { return {parameters_, slope_row_}; }

  std::tuple<bool, int> slopes(const Input& block, const std::optional<Mask>& held, const Output& to) {
    require_block(block);
    require(to.size() == static_cast<std::size_t>(parameters_) * slope_row_, "the slopes must have the slopes_shape");
    require(!held || held->size() == layout_.multipliers.size, "held must have an entry for each contact");
    const Lease continuation(*this);
    const SlopeResult result = continuation->slopes(block.data(), held ? held->data() : nullptr, true, to.data());
    return {result.found, result.left_out};
  }

  Numbers<3> optimality(const Input& block) {
    require_block(block);
    const Lease continuation(*this);
    const Optimality found = continuation->optimality(block.data());
    return {found.stationarity, found.gap, found.complementarity};
  }

 private:
  // Holds the idle continuation for a call. A call amid another one makes its own: the handler of a signal may step, or
  // let another thread do so.
  class Lease {
   public:
    explicit Lease(Kernel& kernel) : kernel_(kernel), held_(kernel.idle_ ? std::move(kernel.idle_) : kernel.make()) {}
    Lease(const Lease&) = delete;
    ~Lease() { kernel_.idle_ = std::move(held_); }
    Continuation<D>* operator->() const { return held_.get(); }

   private:
    Kernel& kernel_;
    std::unique_ptr<Continuation<D>> held_;
  };

  std::unique_ptr<Continuation<D>> make() const {
    auto made = make_continuation<D>(robot_, static_cast<int>(obstacles_.size()));
    require_points(made->layout(), obstacles_);
    made->set_obstacles(obstacles_);
    made->set_interruption([] { return PyErr_CheckSignals() != 0; });
    return made;
  }

  void require_block(const Input& block) const {
    require_size(block.size());
    require_sound(layout_, block.data());
  }

  void require_target(const std::vector<double>& command) const {
    require(command.size() == layout_.cables.size + 1,
            "a command must name the displacement of each cable, and length");
    require_command(command.data(), layout_.cables.size);
  }

  void require_size(std::size_t size) const {
    require(size == block_size(), "the block has " + std::to_string(size) +
                                      " numbers; that of this robot and scene has " + std::to_string(block_size()));
  }

  Robot robot_;
  std::vector<Obstacle<D>> obstacles_;
  std::unique_ptr<Continuation<D>> idle_;  // none during a call
  BlockLayout layout_;
  int parameters_, slope_row_;
};

}  // namespace ccr::binding
