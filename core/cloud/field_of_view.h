// Where a sensor looks.
#ifndef STRATA_CORE_CLOUD_FIELD_OF_VIEW_H_
#define STRATA_CORE_CLOUD_FIELD_OF_VIEW_H_

#include "absl/status/status.h"

namespace strata {

// The beams of a sensor that looks along x: `rows` from `down_rad` below its plane to `up_rad`
// above it, `columns` over `width_rad`. The defaults are those of a common spinning one with 32
// beams.
struct FieldOfView {
  double up_rad = 0.186;           // in [-1.571, 1.571]
  double down_rad = 0.535;         // in [-1.571, 1.571]; up_rad + down_rad ≥ 0
  double width_rad = 6.283185307;  // in (0, 2π]
  int rows = 32;                   // in [1, 1000]
  int columns = 1080;              // in [1, 10,000]; rows · columns ≤ 1,000,000
  double max_range_m = 20.0;       // in [0.1, 200]

  // INVALID_ARGUMENT naming what is out of range.
  absl::Status Validate() const;
  friend bool operator==(const FieldOfView&, const FieldOfView&) = default;
};

}  // namespace strata

#endif  // STRATA_CORE_CLOUD_FIELD_OF_VIEW_H_
