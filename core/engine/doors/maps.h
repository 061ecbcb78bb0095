// The maps of an engine, by name: api::Maps.
#ifndef STRATA_CORE_ENGINE_DOORS_MAPS_H_
#define STRATA_CORE_ENGINE_DOORS_MAPS_H_

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/api/maps.h"
#include "core/common/cache_budget.h"
#include "core/engine/doors/map.h"
#include "core/engine/map/directory.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/map/map_stores.h"
#include "core/engine/map/numbers.h"

namespace strata {

class EngineMaps final : public api::Maps {
 public:
  // Opens every map of the store; one that does not open is kept with the reason.
  static absl::StatusOr<std::unique_ptr<EngineMaps>> Open(const EngineOptions& options);

  // NOT_FOUND; or why its file did not open. Where that was for want of room or of a disk that
  // answers, it is tried again, once a second at most.
  absl::StatusOr<std::shared_ptr<Map>> Find(absl::string_view name);

  // The same for those who read its tiles: waits while they are made again (Worker::AwaitDerived).
  absl::StatusOr<std::shared_ptr<Map>> FindWithTiles(const api::Call& call, absl::string_view name);

  EngineNumbers Numbers() const;
  EngineHealth Health() const;

  absl::StatusOr<MapInfo> Create(const api::Call& call,
                                 absl::string_view name,
                                 const MapParameters& parameters) override;
  absl::StatusOr<MapInfo> Get(const api::Call& call, absl::string_view name) override;
  absl::StatusOr<std::vector<MapInfo>> List(const api::Call& call) override;
  absl::Status Delete(const api::Call& call, absl::string_view name) override;
  absl::StatusOr<MapStats> Stats(const api::Call& call, absl::string_view name) override;
  absl::StatusOr<std::vector<EpochInfo>> History(const api::Call& call,
                                                 absl::string_view name) override;
  absl::StatusOr<std::vector<MapClass>> ListClasses(const api::Call& call,
                                                    absl::string_view name) override;
  absl::Status SetClass(const api::Call& call,
                        absl::string_view name,
                        const MapClass& map_class) override;
  absl::Status SetOrigin(const api::Call& call,
                         absl::string_view name,
                         const GeodeticOrigin& origin) override;
  absl::Status Watch(const api::Call& call,
                     absl::string_view name,
                     const api::WatchOptions& options,
                     absl::FunctionRef<absl::Status(const api::MapUpdate&)> sink) override;
  absl::Status Backup(const api::Call& call,
                      absl::string_view name,
                      absl::FunctionRef<absl::Status(const api::BackupPiece&)> sink) override;

 private:
  EngineMaps(const EngineOptions& options,
             std::unique_ptr<const MapDirectory> directory,
             std::unique_ptr<const MapStores> stores)
      : options_(options),
        directory_(std::move(directory)),
        stores_(std::move(stores)),
        caches_(std::make_shared<CacheBudget>(options.cache_bytes)) {}
  absl::StatusOr<std::shared_ptr<Map>> OpenMap(const std::string& name) const;
  // The map if it can be opened now.
  absl::StatusOr<std::shared_ptr<Map>> OpenAgain(const std::string& name);
  // Takes a name for a map that is being made.
  absl::Status Reserve(const std::string& name);
  // Takes the map out of the list, so that nobody finds it any more; its name stays taken.
  absl::StatusOr<std::shared_ptr<Map>> Withdraw(absl::string_view name);

  class CopyTurn;

  const EngineOptions options_;
  const std::unique_ptr<const MapDirectory> directory_;
  const std::unique_ptr<const MapStores> stores_;
  const std::shared_ptr<CacheBudget> caches_;  // of all maps
  absl::Mutex removing_;                       // one map's file is removed at a time
  mutable absl::Mutex mutex_;
  std::map<std::string, absl::StatusOr<std::shared_ptr<Map>>, std::less<>> maps_
      ABSL_GUARDED_BY(mutex_);
  std::set<std::string, std::less<>> opening_ ABSL_GUARDED_BY(mutex_);  // those opened again
  std::map<std::string, absl::Time, std::less<>> next_try_ ABSL_GUARDED_BY(mutex_);
  std::set<std::string, std::less<>> copied_
      ABSL_GUARDED_BY(mutex_);  // maps with a copy being made
  std::map<std::string, absl::Time, std::less<>> backed_up_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_MAPS_H_
