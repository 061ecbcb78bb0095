// What the next difference of coordinates is predicted to be, as LAZ has it: about the median of
// those before.
#ifndef STRATA_CLIENT_FORMATS_LAZ_STEP_MEDIAN_H_
#define STRATA_CLIENT_FORMATS_LAZ_STEP_MEDIAN_H_

#include <array>
#include <cstddef>
#include <cstdint>

namespace strata {

// Five values in order: a new one takes the place of the highest or of the lowest, by turns as
// values come that lie above and below the middle.
class StepMedian {
 public:
  std::int32_t Get() const { return values_[2]; }

  void Add(std::int32_t value) {
    const bool below = drop_highest_ ? value < values_[2] : value <= values_[2];
    std::size_t i = drop_highest_ ? values_.size() - 1 : 0;
    if (drop_highest_) {
      for (; i > 0 && value < values_[i - 1]; --i) values_[i] = values_[i - 1];
    } else {
      for (; i + 1 < values_.size() && values_[i + 1] < value; ++i) values_[i] = values_[i + 1];
    }
    values_[i] = value;
    drop_highest_ = below;
  }

 private:
  std::array<std::int32_t, 5> values_{};
  bool drop_highest_ = true;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_STEP_MEDIAN_H_
