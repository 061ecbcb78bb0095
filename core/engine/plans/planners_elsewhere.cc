#include "core/engine/plans/planners_elsewhere.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "core/common/status.h"
#include "core/world/map_info.h"

namespace strata {

std::shared_ptr<MapPlanner> PlannersElsewhere::FindKept(const std::string& name,
                                                        std::int64_t number) {
  absl::MutexLock lock(&mutex_);
  const auto it = kept_.find(name);
  if (it == kept_.end() || it->second.number != number) return nullptr;
  it->second.used = ++uses_;
  return it->second.planner;
}

absl::StatusOr<std::shared_ptr<MapPlanner>> PlannersElsewhere::Find(const std::string& name,
                                                                    MapStorage& store) {
  const std::int64_t number = store.number();
  if (std::shared_ptr<MapPlanner> kept = FindKept(name, number)) return kept;
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<StorageReader> reader, store.NewReader());
  STRATA_ASSIGN_OR_RETURN(const MapInfo info, reader->GetMapInfo());
  auto made = std::make_shared<MapPlanner>(name, info.parameters, options_, caches_);
  absl::MutexLock lock(&mutex_);
  Entry& entry = kept_[name];
  // Of two that were made at once one is used.
  if (entry.planner == nullptr || entry.number != number) entry = {number, 0, std::move(made)};
  entry.used = ++uses_;
  std::shared_ptr<MapPlanner> found = entry.planner;
  if (kept_.size() > options_.max_open_maps) DropLeastUsed();
  return found;
}

void PlannersElsewhere::DropLeastUsed() {
  kept_.erase(std::min_element(kept_.begin(), kept_.end(), [](const auto& a, const auto& b) {
    return a.second.used < b.second.used;
  }));
}

}  // namespace strata
