// The maps of an engine, by name: api::Maps.
#ifndef STRATA_CORE_ENGINE_DOORS_MAPS_H_
#define STRATA_CORE_ENGINE_DOORS_MAPS_H_

#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/api/maps.h"
#include "core/common/stop.h"
#include "core/engine/doors/map.h"
#include "core/engine/doors/map_reading.h"
#include "core/engine/doors/open_maps.h"
#include "core/engine/map/directory.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/map/map_stores.h"
#include "core/engine/map/numbers.h"

namespace strata {

class EngineMaps final : public api::Maps {
 public:
  // Opens no map yet; those that have something to do soon.
  static absl::StatusOr<std::unique_ptr<EngineMaps>> Open(const EngineOptions& options,
                                                          OpenStores open = OpenMapStores);

  // As OpenMaps::Find(); of shared stores the map shows what others may have seen of it.
  absl::StatusOr<std::shared_ptr<Map>> Find(const Stop& stop, absl::string_view name);

  // The same for those who read its tiles: waits while they are made again (Worker::AwaitDerived).
  absl::StatusOr<std::shared_ptr<Map>> FindWithTiles(const api::Call& call, absl::string_view name);

  // As FindToRead(), and waits as FindWithTiles() where the map is here.
  absl::StatusOr<MapReading> FindTilesToRead(const api::Call& call, absl::string_view name);
  // For calls that only read, and that the store itself can answer where another engine has the
  // map.
  absl::StatusOr<MapReading> FindToRead(const api::Call& call, absl::string_view name);

  // The map where it is here; else its store, for scans that come in here while another engine has
  // the map (MapStores::OpenToAdd()).
  struct Place {
    std::shared_ptr<Map> map;
    std::unique_ptr<MapStorage> store;
  };
  absl::StatusOr<Place> FindToAdd(const Stop& stop, absl::string_view name);
  const EngineOptions& options() const { return options_; }

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
             std::unique_ptr<const MapStores> stores,
             std::unique_ptr<OpenMaps> maps)
      : options_(options),
        directory_(std::move(directory)),
        stores_(std::move(stores)),
        maps_(std::move(maps)) {}

  class CopyTurn;

  const EngineOptions options_;
  const std::unique_ptr<const MapDirectory> directory_;
  const std::unique_ptr<const MapStores> stores_;
  const std::unique_ptr<OpenMaps> maps_;
  absl::Mutex removing_;  // one map's file is removed at a time
  mutable absl::Mutex mutex_;
  std::set<std::string, std::less<>> copied_
      ABSL_GUARDED_BY(mutex_);  // maps with a copy being made
  std::map<std::string, absl::Time, std::less<>> backed_up_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_MAPS_H_
