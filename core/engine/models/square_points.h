// The points of a map's scans, square by square of the plan.
#ifndef STRATA_CORE_ENGINE_MODELS_SQUARE_POINTS_H_
#define STRATA_CORE_ENGINE_MODELS_SQUARE_POINTS_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/common/lru_cache.h"
#include "core/common/stop.h"
#include "core/completion/square_voxels.h"
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

// Which points.
struct PointChoice {
  bool colour = false;                        // only of scans with colours, and those, too
  bool labels = false;                        // only those with a class, and that, too
  std::optional<Eigen::AlignedBox3d> region;  // in the map
};

// A scan is in all squares that it saw, and each is looked at twice: its points are kept for the
// next one as long as they have room among the caches. Not thread-safe.
class SquarePoints {
 public:
  // `core` must outlive it.
  SquarePoints(MapCore& core,
               const PointChoice& choice,
               std::size_t most_points = kMostSquarePoints)
      : core_(core),
        choice_(choice),
        most_points_(most_points),
        held_(core.caches(), core.caches()->max_bytes() / 2) {}

  // Finds the integrated scans of `epoch` and the squares of the region that they are in.
  absl::Status ListScans(std::uint64_t epoch, const Stop& stop);
  // In the order of their places.
  const std::vector<PlanSquare>& squares() const { return squares_; }
  // The points in square `i` and around it, but those that have faded. Of scans that were deleted
  // meanwhile, lost their points or are damaged there are none.
  absl::StatusOr<PosedPoints> Load(std::size_t i, const Stop& stop);

  // The same where choice.labels, scan by scan: the points in square `i` and up to `margin_m` <=
  // kSquareMarginM around it, all of a scan at once.
  absl::Status ForEachLabelled(
      std::size_t i,
      double margin_m,
      const Stop& stop,
      absl::FunctionRef<absl::Status(ScanNumber, std::span<const LabelledPoint>)> use);

  // Those that reach into the region.
  std::uint64_t scans() const { return reaching_; }
  // Of those scans.
  std::uint64_t points() const { return points_; }
  // That Load() has given.
  std::uint64_t loaded() const { return loaded_; }
  std::uint64_t without_points() const { return without_points_; }
  // Left out for that.
  std::uint64_t without_colour() const { return without_colour_; }
  const DamagedScans& damaged() const { return damaged_; }
  // Of the squares loaded so far those with more points than may be, and of how many points of
  // the fullest one was taken.
  std::uint64_t thinned_squares() const { return thinned_.size(); }
  std::uint64_t most_thinned() const { return most_thinned_; }

 private:
  struct PlacedScan {
    ScanRecord scan;
    Pose T_map_scan;
  };
  using Place = std::pair<std::int64_t, std::int64_t>;  // of a square
  // Points that count, turned as the map is, from where the scan was.
  struct ScanPoints {
    std::vector<Eigen::Vector3f> points;
    std::vector<Colour> colour;        // of each, where colours count
    std::vector<std::uint16_t> label;  // of each, where labels count
  };

  // Whether any of them reaches into the region.
  bool AddTiles(const std::vector<TileKey>& tiles, std::size_t scan);
  // Gives the points of the scan, at once where it is small enough to be held, else in blocks.
  absl::Status ForEachPart(std::size_t scan,
                           const Stop& stop,
                           absl::FunctionRef<void(const ScanPoints&)> body);
  absl::Status Decode(const PlacedScan& placed,
                      const Stop& stop,
                      absl::FunctionRef<void(ScanPoints)> body);
  // Adds what is inside of `around`; counts those that were `inside` and takes one of `every`.
  struct Thinned {
    PosedPoints points;
    std::uint64_t inside = 0;
    std::uint64_t every = 1;
  };
  void Append(const PlacedScan& placed,
              const ScanPoints& part,
              const PlanSquare& around,
              Thinned& thinned) const;
  // Whether what the scan's points could not be read for is no fault of the job.
  absl::StatusOr<bool> MayLeaveOut(const PlacedScan& placed, const absl::Status& why);

  MapCore& core_;
  const PointChoice choice_;
  const std::size_t most_points_;  // of a square
  std::vector<PlacedScan> scans_;
  absl::btree_map<Place, std::vector<std::size_t>> scans_around_;
  std::vector<PlanSquare> squares_;
  std::vector<Place> places_;
  std::uint64_t reaching_ = 0;
  std::uint64_t points_ = 0;
  std::uint64_t loaded_ = 0;
  std::uint64_t without_points_ = 0;
  std::uint64_t without_colour_ = 0;
  std::uint64_t epoch_ = 0;
  DamagedScans damaged_;
  LruCache<std::size_t, const ScanPoints> held_;  // by index of the scan
  absl::btree_set<std::size_t> thinned_;          // squares
  std::uint64_t most_thinned_ = 1;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MODELS_SQUARE_POINTS_H_
