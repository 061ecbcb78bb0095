// The three numbers that define a multi-level surface map (thesis 6.5.2), and the fixed-point units
// it computes in.
#ifndef STRATA_CORE_MLS_MLS_PARAMETERS_H_
#define STRATA_CORE_MLS_MLS_PARAMETERS_H_

#include <cstdint>

#include "absl/status/status.h"

namespace strata {

// Heights are whole ticks of 2⁻¹² m (0.244 mm) within ±2048 m of the map's origin, so that sums of
// them are exact.
inline constexpr int kTicksPerMetre = 4096;
inline constexpr std::int32_t kMaxZTicks = (1 << 23) - 1;

struct MlsParameters {
  double cell_size_m = 0.1;  // edge of a cell; in [0.01, 100]
  double gap_size_m = 1.0;   // γ: heights closer than this are one interval; in [0.01, 100]
  double thickness_m = 0.1;  // τ: a taller interval is vertical; in [0.001, 1]

  // γ and τ in ticks, rounded down. An interval takes in a height at most gap_ticks() - 1 above its
  // top when γ is a whole number of ticks ("closer than γ"), and is vertical when taller than
  // thickness_ticks().
  std::int32_t gap_ticks() const { return static_cast<std::int32_t>(gap_size_m * kTicksPerMetre); }
  std::int32_t thickness_ticks() const {
    return static_cast<std::int32_t>(thickness_m * kTicksPerMetre);
  }

  friend bool operator==(const MlsParameters&, const MlsParameters&) = default;
};

// INVALID_ARGUMENT naming every field that is not finite or out of its range.
absl::Status ValidateMlsParameters(const MlsParameters& parameters);

}  // namespace strata

#endif  // STRATA_CORE_MLS_MLS_PARAMETERS_H_
