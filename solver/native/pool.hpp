// A pool of threads that wait for work.
#pragma once

#include <unistd.h>

#include <atomic>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

namespace ccr {

class Pool {
 public:
  explicit Pool(int helpers) : helpers_(helpers) {}
  Pool(const Pool&) = delete;
  ~Pool() { stop(); }

  // Calls `job` with 0 in this thread and with 1, 2, … in the helpers; returns when all calls have returned. While it
  // waits for the helpers it calls `poll` now and then, after each `beat`.
  template <class Poll>
  void run(const std::function<void(int)>& job, Poll&& poll) {
    if (!team_ || team_->process != getpid()) start();
    Team& team = *team_;
    team.job = &job;
    team.busy.store(helpers_);
    team.round.fetch_add(1);
    team.round.notify_all();
    job(0);
    for (int beats = team.beats.load(); team.busy.load() > 0; beats = team.beats.load()) {
      await(team.beats, [beats](int now) { return now != beats; });
      poll();
    }
  }

  void run(const std::function<void(int)>& job) {
    run(job, [] {});
  }

  // Called by a helper amid a long job.
  void beat() { beat(*team_); }

 private:
  struct Team {
    int process;
    const std::function<void(int)>* job = nullptr;
    std::atomic<int> round = 0, busy = 0, beats = 0;
    bool over = false;
    std::vector<std::thread> threads;
  };

  static constexpr int kSpins = 2000;  // before a waiting thread sleeps

  static void beat(Team& team) {
    team.beats.fetch_add(1);
    team.beats.notify_all();
  }

  template <class Done>
  static int await(std::atomic<int>& value, Done done) {
    int now = value.load();
    for (int spin = 0; spin < kSpins && !done(now); ++spin) now = value.load();
    while (!done(now)) {
      value.wait(now);
      now = value.load();
    }
    return now;
  }

  // Threads do not survive a fork: the child abandons the old team and starts its own.
  void start() {
    team_.release();
    team_ = std::make_unique<Team>();
    team_->process = getpid();
    for (int k = 1; k <= helpers_; ++k)
      team_->threads.emplace_back([team = team_.get(), k] {
        for (int seen = 0;;) {
          seen = await(team->round, [seen](int round) { return round != seen; });
          if (team->over) return;
          (*team->job)(k);
          if (team->busy.fetch_sub(1) == 1) beat(*team);
        }
      });
  }

  void stop() {
    if (!team_) return;
    if (team_->process != getpid()) return static_cast<void>(team_.release());
    team_->over = true;
    team_->round.fetch_add(1);
    team_->round.notify_all();
    for (std::thread& thread : team_->threads) thread.join();
  }

  int helpers_;
  std::unique_ptr<Team> team_;
};

}  // namespace ccr
