// Free, occupied and unknown space of a map, out of its scans.
#ifndef STRATA_CORE_ENGINE_PLANS_SEEN_SPACES_H_
#define STRATA_CORE_ENGINE_PLANS_SEEN_SPACES_H_

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include <Eigen/Geometry>

#include "core/common/cache_budget.h"
#include "core/common/lru_cache.h"
#include "core/common/stop.h"
#include "core/engine/map/map_state.h"
#include "core/planning/viewpoints.h"
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
  struct Key {
    std::array<double, 7> numbers;  // region, size of voxels
    std::uint64_t commit_sequence = 0;
    friend bool operator==(const Key&, const Key&) = default;
    template <typename H>
    friend H AbslHashValue(H h, const Key& key) {
      return H::combine(std::move(h), key.numbers, key.commit_sequence);
    }
  };

  // Until nobody makes one; then this does.
  absl::Status AwaitTurn(const Stop& stop);
  absl::StatusOr<std::shared_ptr<const SeenSpace>> Make(MapState& state,
                                                        const Eigen::AlignedBox3d& region,
                                                        double voxel_m,
                                                        const Stop& stop);

  const std::string name_;
  const MapParameters parameters_;
  const std::shared_ptr<CacheBudget> caches_;
  absl::Mutex mutex_;
  bool making_ ABSL_GUARDED_BY(mutex_) = false;  // one at a time, each of them large
  LruCache<Key, const SeenSpace> known_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_PLANS_SEEN_SPACES_H_
