// Many robots alike, each among its own obstacles, moved by one call.
#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "solve/continuation.hpp"
#include "pool.hpp"

namespace ccr {

// Each robot's answer is its own: it depends neither on the others, nor on how many threads share the work.
template <int D>
class Batch {
 public:
  Batch(const Robot& robot, int count, int obstacles, int threads) : scenes_(count), pool_(threads - 1) {
    for (int k = 0; k < threads; ++k) workers_.push_back(make_continuation<D>(robot, obstacles));
  }

  const BlockLayout& layout() const { return workers_[0]->layout(); }
  std::vector<Obstacle<D>>& scene(int robot) { return scenes_[robot]; }

  // Calls `work` with a continuation among the obstacles of each of some robots, and the place of the robot in the list, until
  // the calling thread is told to `stop`.
  template <class Work, class Stop>
  void each(const std::vector<int>& robots, Work work, Stop&& stop) {
    std::atomic<int> next = 0;
    const int count = static_cast<int>(robots.size());
    const auto run = [&](int thread) {
      Continuation<D>& worker = *workers_[thread];
      for (int first; (first = next.fetch_add(kChunk)) < count;) {
        for (int k = first; k < std::min(first + kChunk, count); ++k) {
          worker.set_obstacles(scenes_[robots[k]]);
          work(worker, k);
        }
        if (thread == 0 && stop()) next = count;
      }
    };
    if (workers_.size() == 1 || count <= kAlone) return run(0);
    pool_.run(std::ref(run));  // a function that holds it would be allocated
  }

  template <class Work>
  void each(const std::vector<int>& robots, Work work) {
    const auto never = [] { return false; };
    each(robots, work, never);
  }

 private:
  static constexpr int kChunk = 2;   // robots taken at a time
  static constexpr int kAlone = 16;  // robots that are not worth waking a thread for

  std::vector<std::vector<Obstacle<D>>> scenes_;
  std::vector<std::unique_ptr<Continuation<D>>> workers_;
  Pool pool_;
};

}  // namespace ccr
