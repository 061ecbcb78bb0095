// How scans of a map are read by what keeps something of them between calls: of a map that is open
// here, or of the store of one that another engine has.
#ifndef STRATA_CORE_ENGINE_SCANS_SCAN_ACCESS_H_
#define STRATA_CORE_ENGINE_SCANS_SCAN_ACCESS_H_

#include <memory>
#include <utility>

#include "absl/status/statusor.h"

#include "core/common/cache_budget.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/map_state.h"
#include "core/engine/map/snapshots.h"
#include "core/storage/storage.h"
#include "core/world/map_info.h"

namespace strata {

// What it is made of must outlive it and its copies. Thread-safe.
class ScanAccess {
 public:
  explicit ScanAccess(MapCore& core)
      : core_(&core), options_(&core.options()), caches_(core.caches()) {}
  // `store` as of MapStores::OpenToRead(); `parameters`: the map's.
  ScanAccess(MapStorage& store,
             const MapParameters& parameters,
             const EngineOptions& options,
             std::shared_ptr<CacheBudget> caches)
      : store_(&store), parameters_(parameters), options_(&options), caches_(std::move(caches)) {}

  absl::StatusOr<MapState::Loan> Reader() const;
  // Where the map stands now.
  absl::StatusOr<MapView> View() const;
  MapParameters parameters() const {
    return core_ != nullptr ? core_->info().parameters : parameters_;
  }
  int threads() const { return options_->worker_threads; }
  const std::shared_ptr<CacheBudget>& caches() const { return caches_; }
  // What was made of a scan, for the next who asks; of a map that is open here. A store that is
  // full is no reason to stop.
  void Keep(ScanNumber number, const ScanView& view) const;

 private:
  MapCore* core_ = nullptr;
  MapStorage* store_ = nullptr;
  MapParameters parameters_;
  const EngineOptions* options_;
  std::shared_ptr<CacheBudget> caches_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_SCANS_SCAN_ACCESS_H_
