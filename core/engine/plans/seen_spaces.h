// Free, occupied and unknown space of a map, out of its scans.
#ifndef STRATA_CORE_ENGINE_PLANS_SEEN_SPACES_H_
#define STRATA_CORE_ENGINE_PLANS_SEEN_SPACES_H_

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include <Eigen/Geometry>

#include "core/common/cache_budget.h"
#include "core/common/lru_cache.h"
#include "core/common/stop.h"
#include "core/engine/map/map_state.h"
#include "core/engine/scans/scan_source.h"
#include "core/geometry/pose.h"
#include "core/planning/viewpoints.h"
#include "core/storage/records.h"
#include "core/world/map_info.h"

namespace strata {

// Thread-safe. Keeps what fits the caches of all maps; nothing of it is stored.
class SeenSpaces {
 public:
  // Of a map; `caches`: of all maps.
  SeenSpaces(std::string name,
             const MapParameters& parameters,
             const std::shared_ptr<CacheBudget>& caches);

  // Of the scans that are integrated, where they are in `state`, without points that have faded;
  // each says all that many would (InverseSensorModel::OfOneLook). FAILED_PRECONDITION: scans may
  // have seen the region, but the points of all of them were dropped; as `stop` says.
  absl::StatusOr<std::shared_ptr<const SeenSpace>> Find(MapState& state,
                                                        const Eigen::AlignedBox3d& region,
                                                        double voxel_m,
                                                        const Stop& stop);

 private:
  using Key = std::array<double, 7>;  // region, size of voxels
  // A scan as it was cast.
  struct Cast {
    ScanNumber number = 0;
    std::uint64_t faded_points = 0;
    Pose T_map_scan = Pose::Identity();
    bool left_out = false;

    bool Is(const PosedScan& posed) const;
  };
  struct Known {
    std::uint64_t commit_sequence = 0;  // of which it is
    std::vector<Cast> casts;            // in this order
    std::shared_ptr<const SeenSpace> space;
  };

  // Until nobody makes one; then this does.
  absl::Status AwaitTurn(const Stop& stop);
  // What is known goes on where it is the beginning of what is to be made.
  absl::StatusOr<std::shared_ptr<const Known>> Make(MapState& state,
                                                    const Eigen::AlignedBox3d& region,
                                                    double voxel_m,
                                                    const Known* before,
                                                    const Stop& stop);
  // INVALID_ARGUMENT: the options.
  absl::StatusOr<SeenSpace> Begin(const Eigen::AlignedBox3d& region, double voxel_m) const;
  absl::Status Add(ScanSource& source,
                   const PosedScan& posed,
                   const Stop& stop,
                   std::vector<Cast>& casts,
                   SeenSpace& seen) const;

  const std::string name_;
  const MapParameters parameters_;
  const std::shared_ptr<CacheBudget> caches_;
  absl::Mutex mutex_;
  bool making_ ABSL_GUARDED_BY(mutex_) = false;  // one at a time, each of them large
  LruCache<Key, const Known> known_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_PLANS_SEEN_SPACES_H_
