// Many robots alike, each among its own obstacles, moved by one call.
#pragma once

#include <algorithm>
#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "branch.hpp"

namespace ccr {

// Each robot's answer is its own: it depends neither on the others, nor on how many threads share the work.
class Batch {
 public:
  Batch(bool sliding, const Robot& robot, int count, int obstacles, int threads) : scenes_(count) {
    for (int k = 0; k < threads; ++k) workers_.push_back(make_follower(sliding, robot, obstacles));
  }

  Batch(const Batch&) = delete;

  std::size_t block_size() const { return workers_[0]->block_size(); }
  std::vector<Obstacle>& scene(int robot) { return scenes_[robot]; }

  // Calls `work` with a follower among the obstacles of each of some robots, and the place of the robot in the list.
  template <class Work>
  void each(const std::vector<int>& robots, Work work) {
    std::atomic<int> next = 0;
    const int count = static_cast<int>(robots.size());
    const auto run = [&](Follower& worker) {
      for (int first; (first = next.fetch_add(kChunk)) < count;)
        for (int k = first; k < std::min(first + kChunk, count); ++k) {
          worker.enter(scenes_[robots[k]]);
          work(worker, k);
        }
    };
    std::vector<std::jthread> helpers;
    for (std::size_t k = 1; k < workers_.size() && static_cast<int>(k) * kChunk < count; ++k)
      helpers.emplace_back([&, k] { run(*workers_[k]); });
    run(*workers_[0]);
  }

 private:
  static constexpr int kChunk = 4;  // robots taken at a time

  std::vector<std::vector<Obstacle>> scenes_;
  std::vector<std::unique_ptr<Follower>> workers_;
};

}  // namespace ccr
