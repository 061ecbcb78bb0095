// What classes of surfaces cost a query, as the search multiplies it.
#ifndef STRATA_CORE_PLANNING_CLASS_FACTORS_H_
#define STRATA_CORE_PLANNING_CLASS_FACTORS_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/planning/move_cost.h"
#include "core/world/plan.h"

namespace strata {

// Factors are whole 1/256, never below one, so that what bounds costs without classes bounds them
// with classes too.
class ClassFactors {
 public:
  ClassFactors() { factor_.fill(kOne); }
  // REQUIRES: ValidateClassCosts(costs).
  explicit ClassFactors(const ClassCosts& costs) : ClassFactors() {
    for (const auto& [id, factor] : costs) {
      factor_[static_cast<std::size_t>(id)] =
          factor == kForbiddenClass ? 0 : static_cast<std::uint32_t>(std::lround(kOne * factor));
    }
    plain_ = std::all_of(factor_.begin(), factor_.end(), [](auto f) { return f == kOne; });
  }

  // True if no class costs more.
  bool plain() const { return plain_; }
  bool Forbidden(std::uint8_t class_id) const { return factor_[class_id] == 0; }
  double Factor(std::uint8_t class_id) const {
    return static_cast<double>(factor_[class_id]) / kOne;
  }
  // Cost of a move between surfaces of two classes, that costs `cost` without them: half of it is
  // on each. REQUIRES: neither is forbidden.
  std::uint32_t Scaled(std::uint32_t cost, std::uint8_t from, std::uint8_t to) const {
    const std::uint64_t twice = std::uint64_t{cost} * (factor_[from] + factor_[to]);
    const std::uint64_t scaled = (twice + kOne) / (2 * std::uint64_t{kOne});  // to nearest
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(scaled, kDearestMove));
  }

 private:
  static constexpr std::uint32_t kOne = 256;
  std::array<std::uint32_t, 256> factor_;
  bool plain_ = true;
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_CLASS_FACTORS_H_
