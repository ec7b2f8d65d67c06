// Replays recorded steps of the kernel for tools that count instructions: replay FILE [WHAT], written by
// instructions.py. WHAT is read, nothing else; step, by default; derivatives, of each step in its cables; all, of each
// step in all parameters; slopes, the same of each equilibrium reached, after the step.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "robots.hpp"
#include "solve/continuation.hpp"

namespace {

class Recording {
 public:
  explicit Recording(const char* path) : file_(std::fopen(path, "rb")) {
    if (!file_) std::exit(2);
  }

  double number() { return numbers(1)[0]; }
  int count() { return static_cast<int>(number()); }

  std::vector<double> numbers(std::size_t count) {
    std::vector<double> values(count);
    if (std::fread(values.data(), sizeof(double), count, file_) != count) std::exit(2);
    return values;
  }

 private:
  std::FILE* file_;
};

// Replays the steps of one robot in some scenes; returns their number.
template <int D>
int replay(Recording& recording, const char* what) {
  const auto is = [what](const char* name) { return std::strcmp(what, name) == 0; };
  const bool reads = is("read"), in_all = is("all"), differentiates = is("derivatives") || in_all,
             slopes = is("slopes");
  ccr::testing::RobotNumbers numbers;
  numbers.cables = recording.numbers(recording.count());
  numbers.rod = !numbers.cables.empty();
  numbers.segments = recording.count();
  numbers.length = recording.number();
  numbers.offset = recording.number();
  numbers.rigidity = recording.number();
  numbers.max_tension = recording.number();
  const ccr::Robot robot = ccr::testing::make_robot<D>(numbers);
  int steps = 0;
  for (int scenes = recording.count(); scenes > 0; --scenes) {
    std::vector<ccr::Obstacle<D>> obstacles;
    for (int left = recording.count(); left > 0; --left) {
      const auto shape = static_cast<ccr::Shape>(recording.count());
      const int size = recording.count();
      obstacles.push_back(ccr::testing::make_obstacle<D>(robot, shape, recording.numbers(size)));
    }
    const auto continuation = ccr::make_continuation<D>(robot, static_cast<int>(obstacles.size()));
    continuation->set_obstacles(obstacles);
    std::vector<double> to(continuation->layout().size),
        rows((continuation->slope_row() + 1) * continuation->parameters());
    if (recording.count() != static_cast<int>(to.size())) std::exit(3);  // recorded of another robot
    for (int left = recording.count(); left > 0; --left, ++steps) {
      const std::vector<double> command = recording.numbers(continuation->layout().cables.size + 1),
                                from = recording.numbers(to.size());
      if (reads) continue;
      const ccr::StepSlopes wanted{
          .rows = differentiates ? rows.data() : nullptr, .in_length = in_all, .in_obstacles = in_all};
      continuation->follow(from.data(), command.data(), to.data(), wanted);
      if (slopes) continuation->slopes(to.data(), nullptr, true, rows.data());
    }
  }
  return steps;
}

}  // namespace

int main(int count, char** arguments) {
  Recording recording(arguments[1]);
  const char* what = count > 2 ? arguments[2] : "step";
  std::printf("%d\n", recording.count() == 2 ? replay<2>(recording, what) : replay<3>(recording, what));
}
