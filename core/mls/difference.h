// What is different between two states of a part of the world: surfaces that came, went and moved.
#ifndef STRATA_CORE_MLS_DIFFERENCE_H_
#define STRATA_CORE_MLS_DIFFERENCE_H_

#include <cstdint>
#include <vector>

#include "core/mls/surface_tile.h"

namespace strata {

// A surface of which one state or both say something.
struct SurfaceChange {
  enum class Kind : std::uint8_t {
    kSame,     // in both, at heights that do not tell them apart
    kAdded,    // only in the later state
    kRemoved,  // only in the earlier one
    kMoved,    // in both, at another height
  };
  Kind kind = Kind::kSame;
  Surface surface;      // as it is later; of one that was removed, as it was
  float rise_m = 0.0F;  // from its earlier height to its later one; 0 unless in both
};

// A smaller difference of height [m] is none.
inline constexpr double kLeastRiseM = 0.01;

// The surfaces of both tiles, which must have the same key, by (cell, height). Two surfaces of a
// cell are the same one if their tops are less than gap_size_m apart: the nearest two first, each
// with one other at most (on a tie the lower ones). It has moved where the tops differ by more than
// 3·√(σ² + σ²) of the two, and by kLeastRiseM at least. Classes and traversability do not count.
std::vector<SurfaceChange> CompareTiles(const SurfaceTile& earlier,
                                        const SurfaceTile& later,
                                        double gap_size_m);

}  // namespace strata

#endif  // STRATA_CORE_MLS_DIFFERENCE_H_
