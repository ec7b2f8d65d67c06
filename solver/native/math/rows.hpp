// Numbers of all segments, laid out for laws that are evaluated for several segments at a time.
#pragma once

#include <vector>

namespace ccr {

// Numbers of all segments, one row for each number, so that the laws read and write several segments at a time.
class Rows {
 public:
  static constexpr int kPadding = 4;  // at least the number of SIMD lanes

  // Number of segments that there is room for.
  static int room(int segments) { return (segments + kPadding - 1) / kPadding * kPadding; }

  Rows(int numbers, int segments) : stride_(room(segments)), values_(numbers * stride_) {}

  double* row(int number) { return values_.data() + number * stride_; }
  const double* row(int number) const { return values_.data() + number * stride_; }
  double at(int number, int segment) const { return values_[number * stride_ + segment]; }
  void put(int segment, const double* numbers, int count, int first = 0) {
    for (int k = 0; k < count; ++k) values_[(first + k) * stride_ + segment] = numbers[k];
  }
  void get(int segment, double* numbers, int count) const {
    for (int k = 0; k < count; ++k) numbers[k] = at(k, segment);
  }

 private:
  int stride_;
  std::vector<double> values_;
};

}  // namespace ccr
