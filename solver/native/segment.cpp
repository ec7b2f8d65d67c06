#define CCR_REGISTERS baseline
#include "bend.inc"

namespace ccr {

#ifdef CCR_WIDE
namespace wide {
void bend(int n, const double* sines, double pull, double length, double offset, UniformCable::Bends& bends);
void bend(int n, const double* angles, double length, double offset, SlidingCable::Bends& bends);
bool bend(int n, const TwoCables::Told& told, const Rows& controls, Rows& bendings, Rows& bends);
void bow(int n, const TwoCables::Told& told, const Rows& controls, const Rows& bendings, const Rows& adjoints, Rows& bows);
}  // namespace wide

namespace {
const bool has_wide = __builtin_cpu_supports("avx2");
}
#endif

void UniformCable::bend(int n, const double* sines, double pull, double length, double offset, Bends& bends) {
#ifdef CCR_WIDE
  if (has_wide) return wide::bend(n, sines, pull, length, offset, bends);
#endif
  baseline::bend(n, sines, pull, length, offset, bends);
}

void SlidingCable::bend(int n, const double* angles, double, double length, double offset, Bends& bends) {
#ifdef CCR_WIDE
  if (has_wide) return wide::bend(n, angles, length, offset, bends);
#endif
  baseline::bend(n, angles, length, offset, bends);
}

bool TwoCables::bend(int n, const Told& told, const Rows& controls, Rows& bendings, Rows& bends) {
#ifdef CCR_WIDE
  if (has_wide) return wide::bend(n, told, controls, bendings, bends);
#endif
  return baseline::bend(n, told, controls, bendings, bends);
}

void TwoCables::bow(int n, const Told& told, const Rows& controls, const Rows& bendings, const Rows& adjoints, Rows& bows) {
#ifdef CCR_WIDE
  if (has_wide) return wide::bow(n, told, controls, bendings, adjoints, bows);
#endif
  baseline::bow(n, told, controls, bendings, adjoints, bows);
}

}  // namespace ccr
