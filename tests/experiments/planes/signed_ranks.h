// Wilcoxon's test of paired differences.
#ifndef STRATA_TESTS_EXPERIMENTS_PLANES_SIGNED_RANKS_H_
#define STRATA_TESTS_EXPERIMENTS_PLANES_SIGNED_RANKS_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace strata::testing {

// How likely differences would be as large as these or larger if each had either sign with equal
// chance: exactly, by all signs, one-sided. Zeros are left out, ties share their rank. At most 20.
inline double SignedRankProbability(std::vector<double> differences) {
  std::erase(differences, 0.0);
  const std::size_t n = differences.size();
  std::vector<double> rank(n);
  double seen = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    for (const double other : differences) {
      const double a = std::abs(other);
      const double b = std::abs(differences[i]);
      rank[i] += a < b ? 1.0 : a == b ? 0.5 : 0.0;
    }
    rank[i] += 0.5;
    if (differences[i] > 0.0) seen += rank[i];
  }
  std::size_t as_large = 0;
  for (std::uint32_t signs = 0; signs < (1U << n); ++signs) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) sum += ((signs >> i) & 1U) != 0 ? rank[i] : 0.0;
    as_large += sum >= seen - 1e-9 ? 1 : 0;
  }
  return static_cast<double>(as_large) / static_cast<double>(1U << n);
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_PLANES_SIGNED_RANKS_H_
