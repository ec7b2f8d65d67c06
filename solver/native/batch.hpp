// Many robots of one layout, each among its own obstacles, moved by one call.
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
      : obstacles_(obstacles),
        scenes_(count),
        robot_(std::make_shared<const Robot>(robot)),
        robots_(count, robot_),
        present_(threads, robot_.get()),
        pool_(threads - 1) {
    for (int k = 0; k < threads; ++k) {
      workers_.push_back(make_continuation<D>(robot, obstacles));
      workers_[k]->set_interruption([this, k] { return is_stopped(k); });
    }
  }

  const BlockLayout& layout() const { return workers_[0]->layout(); }
  int count() const { return static_cast<int>(scenes_.size()); }
  int obstacles() const { return obstacles_; }  // of each scene
  int slope_row() const { return workers_[0]->slope_row(); }

  // Puts a robot, by its index, among other obstacles.
  void set_obstacles(int robot, std::vector<Obstacle<D>> obstacles) { scenes_[robot] = std::move(obstacles); }

  const Robot& robot() const { return *robot_; }
  // Makes a robot, by its index, another one of the same layout; null for the batch's.
  void set_robot(int index, const Robot* robot) {
    robots_[index] = robot ? std::make_shared<const Robot>(*robot) : robot_;
    std::fill(present_.begin(), present_.end(), nullptr);  // whose addresses may come again
  }

  const std::vector<Obstacle<D>>& scene(int robot) const { return scenes_[robot]; }
  // Makes robots those of another batch, of equal robots, and puts them among the same obstacles.
  void copy(const Batch& other, const std::vector<int>& robots) {
    for (const int robot : robots) {
      scenes_[robot] = other.scenes_[robot];
      robots_[robot] = other.robots_[robot] == other.robot_ ? robot_ : other.robots_[robot];
    }
    std::fill(present_.begin(), present_.end(), nullptr);
  }

  int threads() const { return static_cast<int>(workers_.size()); }

  // The continuation of a thread in the place of a robot.
  Continuation<D>& at(int thread, int robot) {
    place(thread, robot);
    return *workers_[thread];
  }

  // Lets the calls of another batch, within whose work this one is used, say when to end.
  void set_leader(Batch* leader) { leader_ = leader; }

  // Calls `work` with a thread and the index in the list of each of these robots, until `stop` returns true. It is
  // called in the calling thread only, between robots and amid their steps.
  template <class Work, class Stop>
  void share(const std::vector<int>& robots, Work work, Stop&& stop) {
    stop_ = std::ref(stop);
    stopped_ = false;
    std::atomic<int> next = 0;
    const int count = static_cast<int>(robots.size());
    const auto run = [&](int thread) {
      for (int first; !stopped_ && (first = next.fetch_add(kChunk)) < count;) {
        for (int k = first; k < std::min(first + kChunk, count) && !stopped_; ++k) work(thread, k);
        if (thread == 0) is_stopped(0);
      }
    };
    if (workers_.size() == 1 || count <= kAlone) return run(0);
    pool_.run(std::ref(run), [this] { is_stopped(0); });  // a function that owned it would be allocated
  }

  // Calls `work` with a continuation among the obstacles of each robot instead.
  template <class Work, class Stop>
  void each(const std::vector<int>& robots, Work work, Stop&& stop) {
    share(robots, [&](int thread, int k) { work(at(thread, robots[k]), k); }, stop);
  }

  template <class Work>
  void each(const std::vector<int>& robots, Work work) {
    const auto never = [] { return false; };
    each(robots, work, never);
  }

 private:
  static constexpr int kChunk = 2;   // robots taken at a time
  static constexpr int kAlone = 16;  // so few robots are not worth waking a thread for

  // Puts the worker of a thread in the place of a robot.
  void place(int thread, int robot) {
    const Robot* wanted = robots_[robot].get();
    if (present_[thread] != wanted) workers_[thread]->set_robot(*wanted);
    present_[thread] = wanted;
    workers_[thread]->set_obstacles(scenes_[robot]);
  }

  // Whether the call under way is to end. The calling thread asks; the others wake it to do so.
  bool is_stopped(int thread) {
    if (leader_) return leader_->is_stopped(thread);
    if (thread > 0)
      pool_.beat();
    else if (!stopped_)
      stopped_ = stop_();
    return stopped_;
  }

  int obstacles_;
  std::vector<std::vector<Obstacle<D>>> scenes_;
  std::shared_ptr<const Robot> robot_;
  std::vector<std::shared_ptr<const Robot>> robots_;
  std::vector<const Robot*> present_;  // of each worker; null where it is to be set again
  std::vector<std::unique_ptr<Continuation<D>>> workers_;
  Batch* leader_ = nullptr;
  std::function<bool()> stop_;  // of the call under way
  std::atomic<bool> stopped_ = false;
  Pool pool_;
  std::atomic_flag busy_;
};

}  // namespace ccr
