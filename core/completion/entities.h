// Points that have a class become things (thesis 11.2.1): what lies nearer together than a
// threshold is one.
#ifndef STRATA_CORE_COMPLETION_ENTITIES_H_
#define STRATA_CORE_COMPLETION_ENTITIES_H_

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/common/stop.h"
#include "core/completion/square_voxels.h"
#include "core/world/things/entity.h"

namespace strata {

// The threshold is never larger, so that this much around a square is enough [m].
inline constexpr double kMostEntityDistanceM = 4.0;

struct EntityOptions {
  // Points of a class that are so near are one entity; 0: three times the spacing of its points,
  // the median distance of a voxel to its fourth neighbour, four being next to a point of an even
  // surface. In [0, kMostEntityDistanceM].
  double distance_m = 0.0;
  // Points of a cube of this edge are one; in [0.01, 1]. Many scans of a surface have the spacing
  // of one, then.
  double voxel_m = 0.05;
  std::uint64_t min_points = 50;  // of an entity, in all scans; at least 1

  // INVALID_ARGUMENT naming every field out of its range.
  absl::Status Validate() const;
};

// An entity, with scans as the caller numbers them.
struct FoundEntity {
  struct Seen {
    std::uint32_t scan = 0;
    std::uint64_t points = 0;
  };
  std::uint16_t class_id = 0;
  UprightBox box;
  double radius_m = 0.0;
  std::uint64_t points = 0;
  std::vector<Seen> scans;              // by number
  std::vector<Eigen::Vector3d> voxels;  // the mean of the points of each, map frame
};

// Takes the squares of a map one after another, each twice: first for the spacing of its points,
// then to grow regions (Alg. 2 without normals) across the borders of squares: an edge between two
// of them is found by the second, which has what is around it. Squares may be of any size; which
// entities there are depends neither on that nor on their order, but for distances that differ by
// the rounding of floats. Memory grows with the voxels.
// Not thread-safe.
class EntityFinder {
 public:
  // REQUIRES: valid options.
  explicit EntityFinder(const EntityOptions& options);
  ~EntityFinder();

  // Of the voxels that it wants of a square, with what is around it: first round.
  SquareVoxels ForSpacing(const Eigen::AlignedBox2d& square) const;
  absl::Status Measure(const SquareVoxels& voxels, const Stop& stop);
  // Ends the first round: how near points of each class are one entity [m].
  const std::map<std::uint16_t, double>& Reaches();
  // Second round. REQUIRES: Reaches().
  SquareVoxels ForGrowing(const Eigen::AlignedBox2d& square) const;
  absl::Status Grow(const SquareVoxels& voxels, const Stop& stop);
  // By class, falling number of points, and place.
  absl::StatusOr<std::vector<FoundEntity>> Finish(const Stop& stop);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace strata

#endif  // STRATA_CORE_COMPLETION_ENTITIES_H_
