// Many robots alike, each among its own obstacles, moved by one call.
#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "pool.hpp"
#include "solve/continuation.hpp"

namespace ccr {

// Results do not depend on the other robots, nor on the number of threads. One thread at a time uses a batch.
template <int D>
class Batch {
 public:
  // Taken by the thread that uses the batch; refuses another one meanwhile.
  class Lock {
   public:
    explicit Lock(Batch& batch) : busy_(batch.busy_) {
      if (busy_.test_and_set())
        throw std::runtime_error("the batch is in use by another thread; give each thread a batch of its own");
    }
    Lock(const Lock&) = delete;
    ~Lock() { busy_.clear(); }

   private:
    std::atomic_flag& busy_;
  };

  Batch(const Robot& robot, int count, int obstacles, int threads)
      : obstacles_(obstacles), scenes_(count), pool_(threads - 1) {
    for (int k = 0; k < threads; ++k) workers_.push_back(make_continuation<D>(robot, obstacles));
  }

  const BlockLayout& layout() const { return workers_[0]->layout(); }
  int count() const { return static_cast<int>(scenes_.size()); }
  int obstacles() const { return obstacles_; }  // of each scene

  // Puts a robot, by its index, among other obstacles.
  void set_obstacles(int robot, std::vector<Obstacle<D>> obstacles) { scenes_[robot] = std::move(obstacles); }

  // Calls `work` with a continuation among the obstacles of each of these robots, and its index in the list, until
  // `stop` returns true in the calling thread.
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
    pool_.run(std::ref(run));  // a function that owned it would be allocated
  }

  template <class Work>
  void each(const std::vector<int>& robots, Work work) {
    const auto never = [] { return false; };
    each(robots, work, never);
  }

 private:
  static constexpr int kChunk = 2;   // robots taken at a time
  static constexpr int kAlone = 16;  // so few robots are not worth waking a thread for

  int obstacles_;
  std::vector<std::vector<Obstacle<D>>> scenes_;
  std::vector<std::unique_ptr<Continuation<D>>> workers_;
  Pool pool_;
  std::atomic_flag busy_;
};

}  // namespace ccr
