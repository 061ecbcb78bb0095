// The points of a map's scans, square by square of the plan.
#ifndef STRATA_CORE_ENGINE_MODELS_SQUARE_POINTS_H_
#define STRATA_CORE_ENGINE_MODELS_SQUARE_POINTS_H_

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Geometry>

#include "core/common/stop.h"
#include "core/engine/map/map_core.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/geometry/pose.h"
#include "core/planes/models/plane_model_finder.h"
#include "core/storage/storage.h"

namespace strata {

// A side of a square, whole multiples of which bound squares [m].
inline constexpr double kSquareM = 60.0;
// So much is seen around a square, too [m].
inline constexpr double kSquareMarginM = 5.0;
// Points of a square; of more, every second, every fourth … is taken.
inline constexpr std::size_t kMostSquarePoints = 4'000'000;

// Not thread-safe.
class SquarePoints {
 public:
  // `core` must outlive it.
  explicit SquarePoints(MapCore& core) : core_(core) {}

  // Finds the integrated scans of `epoch` and the squares that they are in.
  absl::Status ListScans(std::uint64_t epoch, const Stop& stop);
  // In the order of their places.
  const std::vector<PlanSquare>& squares() const { return squares_; }
  // The points in square `i` and around it, but those that have faded. Of scans that were deleted
  // meanwhile, lost their points or are damaged there are none.
  absl::StatusOr<PosedPoints> Load(std::size_t i, const Stop& stop);

  std::uint64_t scans() const { return scans_.size(); }
  // Of all scans.
  std::uint64_t points() const { return points_; }
  std::uint64_t without_points() const { return without_points_; }
  const DamagedScans& damaged() const { return damaged_; }

 private:
  struct PlacedScan {
    ScanRecord scan;
    Pose T_map_scan;
  };
  using Place = std::pair<std::int64_t, std::int64_t>;  // of a square

  void AddTiles(const std::vector<TileKey>& tiles, std::size_t scan);
  // Adds what is inside of `around`; counts those that were `inside` and takes one of `every`.
  struct Thinned {
    PosedPoints points;
    std::uint64_t inside = 0;
    std::uint64_t every = 1;
  };
  absl::Status Append(const PlacedScan& placed,
                      const PlanSquare& around,
                      const Stop& stop,
                      Thinned& thinned);
  // Whether what the scan's points could not be read for is no fault of the job.
  absl::StatusOr<bool> MayLeaveOut(const PlacedScan& placed, const absl::Status& why);

  MapCore& core_;
  std::vector<PlacedScan> scans_;
  absl::btree_map<Place, std::vector<std::size_t>> scans_around_;
  std::vector<PlanSquare> squares_;
  std::vector<Place> places_;
  std::uint64_t points_ = 0;
  std::uint64_t without_points_ = 0;
  std::uint64_t epoch_ = 0;
  DamagedScans damaged_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MODELS_SQUARE_POINTS_H_
