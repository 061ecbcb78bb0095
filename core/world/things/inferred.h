// What nobody saw of the things in a map, by what others of their kinds look like (thesis 11.2.3).
// Never part of what was measured.
#ifndef STRATA_CORE_WORLD_THINGS_INFERRED_H_
#define STRATA_CORE_WORLD_THINGS_INFERRED_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/time/time.h"
#include <Eigen/Core>

namespace strata {

// Of one entity; of more, every second, every fourth … is kept.
inline constexpr std::size_t kMostInferredPoints = 100'000;

// What is added to one entity.
struct InferredPart {
  std::uint64_t entity = 0;  // its id
  std::uint64_t kind = 0;    // its kind's id
  // Voxels of its kind's shape where it was measured, and where rays went through; beyond a quarter
  // of those nothing is inferred, and it is probably of another kind; neither below a fifth of
  // the shape.
  std::uint64_t agreeing = 0;
  std::uint64_t contradicting = 0;
  std::vector<Eigen::Vector3d> points;  // where no ray went, map frame [m]

  friend bool operator==(const InferredPart&, const InferredPart&) = default;
};

// How a map's inferred parts came about.
struct InferredInfo {
  std::uint64_t job = 0;    // that inferred them
  std::uint64_t epoch = 0;  // whose poses they stand on
  absl::Time made;
  std::uint64_t kinds = 0;     // that had entities
  std::uint64_t entities = 0;  // of those kinds; fewer are left where scans were deleted
  std::uint64_t points = 0;    // inferred
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_THINGS_INFERRED_H_
