// Replays recorded steps of the kernel, for tools that count instructions: replay FILE, as instructions.py writes it.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "branch.hpp"

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

ccr::Obstacle<2> read_circle(Recording& recording, int points) {
  const std::vector<double> circle = recording.numbers(3);
  ccr::Obstacle<2> obstacle{};
  obstacle.shape = ccr::Shape::kCircle;
  for (int k = 0; k < 3; ++k) obstacle.parameters[k] = circle[k];
  obstacle.center = {{circle[0], circle[1]}};
  obstacle.radius = obstacle.fineness = circle[2];
  obstacle.touchable.assign(points, 1);
  obstacle.everywhere = true;
  return obstacle;
}

}  // namespace

int main(int, char** arguments) {
  Recording recording(arguments[1]);
  ccr::Robot robot;
  robot.sliding = recording.count() != 0;
  robot.segments = recording.count();
  robot.offset = recording.number();
  robot.rigidity = recording.number();
  robot.max_tension = recording.number();
  robot.max_length = recording.number();
  robot.angle = 0;
  robot.lines = {{{0, 0}}, {{robot.offset, 0}}};
  robot.between = 0;
  int steps = 0;
  for (int scenes = recording.count(); scenes > 0; --scenes) {
    std::vector<ccr::Obstacle<2>> obstacles;
    for (int left = recording.count(); left > 0; --left) obstacles.push_back(read_circle(recording, robot.points()));
    const auto follower = ccr::make_follower<2>(robot, static_cast<int>(obstacles.size()));
    follower->enter(obstacles);
    std::vector<double> to(follower->block_size());
    for (int left = recording.count(); left > 0; --left, ++steps) {
      const std::vector<double> command = recording.numbers(2), from = recording.numbers(to.size());
      follower->follow(from.data(), command.data(), to.data());
    }
  }
  std::printf("%d\n", steps);
}
