// Planners of maps that other engines have: what they keep of tiles between queries.
#ifndef STRATA_CORE_ENGINE_PLANS_PLANNERS_ELSEWHERE_H_
#define STRATA_CORE_ENGINE_PLANS_PLANNERS_ELSEWHERE_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "core/common/cache_budget.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/plans/map_planner.h"
#include "core/storage/storage.h"

namespace strata {

// What is kept is keyed by the versions of tiles, which belong to their bytes for ever, so none of
// it is ever stale; how much, the caches of all maps say together. Thread-safe.
class PlannersElsewhere {
 public:
  PlannersElsewhere(const EngineOptions& options, std::shared_ptr<CacheBudget> caches)
      : options_(options), caches_(std::move(caches)) {}

  // That of the map in `store`, which is called `name` now. Keeps as many as there may be open
  // maps, those that were asked for last.
  absl::StatusOr<std::shared_ptr<MapPlanner>> Find(const std::string& name, MapStorage& store);

 private:
  struct Entry {
    std::int64_t number = 0;  // of the map, which another one of that name has not
    std::uint64_t used = 0;
    std::shared_ptr<MapPlanner> planner;
  };

  std::shared_ptr<MapPlanner> FindKept(const std::string& name, std::int64_t number);
  void DropLeastUsed() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const EngineOptions options_;
  const std::shared_ptr<CacheBudget> caches_;
  absl::Mutex mutex_;
  std::map<std::string, Entry> kept_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t uses_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_PLANS_PLANNERS_ELSEWHERE_H_
