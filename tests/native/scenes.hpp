// Random robots of any size among random obstacles of every shape.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "random.hpp"
#include "robots.hpp"
#include "solve/continuation.hpp"

namespace ccr::testing {

// Number of shapes, in the plane with a compiled one.
template <int D>
inline constexpr int kShapes = D == 2 ? 6 : 5;

// A compiled gap law: a disc, its centre and radius the parameters.
inline int disc_law(const double** in, double** out, int*, double*, int) {
  const double x = in[0][0] - in[1][0], y = in[0][1] - in[1][1], r = in[1][2];
  const double gap[] = {(x * x + y * y - r * r) / (2 * r), x / r, y / r, 1 / r, 0, 1 / r};
  std::copy(std::begin(gap), std::end(gap), out[0]);
  return 0;
}

inline Obstacle<2> make_custom(const Robot& robot, const Position<2>& center, double r, double spring) {
  Obstacle<2> obstacle = circle(robot, center[0], center[1], r, spring);
  obstacle.shape = Shape::kCustom;
  obstacle.law = disc_law;
  obstacle.outline = ellipse_outline(std::array{center[0], center[1], r, r, 1.0, 0.0}.data());
  return obstacle;
}

// A random obstacle of a shape, about as large as a ball of radius r at a point; walls face the straight robot.
inline Obstacle<2> random_obstacle(Random& random, const Robot& robot, int shape, const Position<2>& at, double r,
                                   double spring) {
  const auto made = [&](Shape kind, std::initializer_list<double> numbers) {
    return make_obstacle<2>(robot, kind, std::vector<double>(numbers), spring);
  };
  const Vec<2> way = random.direction<2>();
  switch (shape) {
    case 0: return made(Shape::kCircle, {at[0], at[1], r});
    case 1: {
      const double tilt = random.uniform(-0.3, 0.3), nx = -std::copysign(std::cos(tilt), at[0]), ny = std::sin(tilt);
      return made(Shape::kHalfPlane, {nx, ny, nx * at[0] + ny * at[1]});
    }
    case 2: return made(Shape::kEllipse, {at[0], at[1], r * random.uniform(1, 2), r, way[0], way[1]});
    case 3:
      return made(Shape::kCapsule, {at[0] - r * way[0], at[1] - r * way[1], at[0] + r * way[0], at[1] + r * way[1], r});
    case 4: {
      const int corners = random.integer(3, 8);
      const double edge = r * random.decades(-2, -0.3), turned = random.uniform(0, 7);
      std::vector<double> numbers = {edge};
      for (int k = 0; k < 8; ++k) {  // the last corner is repeated
        const double angle = turned + 2 * std::numbers::pi * std::min(k, corners - 1) / corners;
        numbers.insert(numbers.end(), {at[0] + 2 * r * std::cos(angle), at[1] + 2 * r * std::sin(angle)});
      }
      return make_obstacle<2>(robot, Shape::kPolygon, numbers, spring);
    }
    default: return make_custom(robot, at, r, spring);
  }
}

inline Obstacle<3> random_obstacle(Random& random, const Robot& robot, int shape, const Position<3>& at, double r,
                                   double spring) {
  const auto made = [&](Shape kind, std::initializer_list<double> numbers) {
    return make_obstacle<3>(robot, kind, std::vector<double>(numbers), spring);
  };
  const Vec<3> way = random.direction<3>();
  const double edge = r * random.decades(-2, -0.3);
  switch (shape) {
    case 0: return made(Shape::kSphere, {at[0], at[1], at[2], r});
    case 1: {
      const double away = std::hypot(at[0], at[1]), nx = -at[0] / away, ny = -at[1] / away;
      return made(Shape::kHalfSpace, {nx, ny, 0, nx * at[0] + ny * at[1]});
    }
    case 2:
      return made(Shape::kSpatialCapsule, {at[0] - r * way[0], at[1] - r * way[1], at[2] - r * way[2],
                                           at[0] + r * way[0], at[1] + r * way[1], at[2] + r * way[2], r});
    case 3:
      return made(Shape::kCylinder,
                  {at[0], at[1], at[2], way[0], way[1], way[2], r - edge, r * random.uniform(1, 2) - edge, edge});
    default: {
      Vec<3> second = cross(way, random.direction<3>());
      const double size = norm(second);
      for (double& part : second.v) part /= size;
      const Vec<3> third = cross(way, second);
      return made(Shape::kBox, {at[0], at[1], at[2], way[0], way[1], way[2], second[0], second[1], second[2], third[0],
                                third[1], third[2], r - edge, r * random.uniform(1, 2) - edge, r - edge, edge});
    }
  }
}

// A random robot, by default from a thousandth to a thousand times the size of the prototype.
template <int D>
RobotNumbers random_robot(Random& random, double decades = 3) {
  const double scale = random.decades(-decades, decades);
  RobotNumbers of;
  of.rod = D == 2 && random.chance(0.5);
  of.segments = random.integer(6, 30);
  of.length = 180 * scale;
  of.offset = of.length * random.uniform(0.03, 0.07);
  of.rigidity = 5000 * scale * scale * random.decades(-1, 1);
  of.max_tension = of.rigidity / (of.offset * of.length) * random.uniform(1.5, 6);
  of.angle = std::numbers::pi * random.uniform(0.35, 0.65);
  of.between = random.chance(0.3) ? random.integer(1, 2) : 0;
  return of;
}

template <int D>
struct Setting {
  Robot robot;
  std::vector<Obstacle<D>> obstacles;
  std::vector<double> rest;  // block of the straight robot
};

template <int D>
std::vector<double> rest_block(Continuation<D>& continuation, double length) {
  std::vector<double> block(continuation.layout().size);
  std::array<double, D> command{};
  command[D - 1] = block[continuation.layout().length.offset] = length;
  continuation.follow(block.data(), command.data(), block.data());
  return block;
}

// Random obstacles clear of the straight robot and too large to slip between its points.
template <int D>
Setting<D> random_setting(Random& random, const RobotNumbers& of, int count, double springs = 0.2) {
  Setting<D> out{make_robot<D>(of), {}, {}};
  const double longest = *std::max_element(out.robot.edges.begin(), out.robot.edges.end());
  const auto continuation = make_continuation<D>(out.robot, 1);
  for (int tries = 0; static_cast<int>(out.obstacles.size()) < count && tries < 200; ++tries) {
    Position<D> at = random.direction<D>();
    const double out_of = of.length * random.uniform(0.12, 0.4);
    if (D == 2) at[0] = at[0] < 0 && random.chance(0.7) ? 1 : std::copysign(1, at[0]);
    const double size = D == 2 ? 1 : std::hypot(at[0], at[1]);
    for (int k = 0; k < D - 1; ++k) at[k] *= out_of / size;
    at[D - 1] = of.length * random.uniform(0.3, 0.95);
    const double r = std::max(of.length * random.uniform(0.04, 0.1), 0.55 * longest);
    const double unit = of.rigidity / (of.length * of.length * of.length);
    const double spring = random.chance(springs) ? unit * random.decades(0, 4) : 0;
    const std::vector<Obstacle<D>> alone = {
        random_obstacle(random, out.robot, random.integer(0, kShapes<D> - 1), at, r, spring)};
    continuation->set_obstacles(alone);
    const std::vector<double> rest = rest_block(*continuation, of.length);
    if (rest[continuation->layout().clearance.offset] > 1e-3 * of.length) out.obstacles.push_back(alone[0]);
  }
  const auto among = make_continuation<D>(out.robot, static_cast<int>(out.obstacles.size()));
  among->set_obstacles(out.obstacles);
  out.rest = rest_block(*among, of.length);
  return out;
}

// Random commands that drift, jump and reverse.
template <int D>
class Commands {
 public:
  Commands(Random& random, const RobotNumbers& of)
      : random_(random), of_(of), inserts_(random.chance(0.15)), lively_(random.decades(-2, -0.5)) {}

  std::array<double, D> next(const std::vector<double>& block) {
    std::array<double, D> command;
    if (random_.chance(0.03)) goal();
    for (int k = 0; k < D - 1; ++k) {
      const double jump = random_.chance(0.03) ? random_.uniform(-1, 1) : 0;
      const double drift = lively_ * (goal_[k] > block[k] / of_.offset ? 0.3 : -0.3);
      const double wanted = block[k] / of_.offset + drift + lively_ * random_.uniform(-1, 1) + jump;
      command[k] = of_.offset * (D == 2 ? std::clamp(wanted, 0.0, 1.8) : std::clamp(wanted, -1.3, 1.3));
    }
    const double length = block[D - 1] / of_.length;
    command[D - 1] = of_.length * (inserts_ ? std::clamp(length + random_.uniform(-0.02, 0.02), 0.7, 1.0) : length);
    return command;
  }

 private:
  void goal() {
    for (double& one : goal_) one = D == 2 ? random_.uniform(-0.5, 2) : random_.uniform(-1.4, 1.4);
  }

  Random& random_;
  RobotNumbers of_;
  bool inserts_;
  double lively_;  // size of an increment, over the offset
  std::array<double, D - 1> goal_{};
};

}  // namespace ccr::testing
