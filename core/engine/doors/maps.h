// The maps of an engine, by name: api::Maps.
#ifndef STRATA_CORE_ENGINE_DOORS_MAPS_H_
#define STRATA_CORE_ENGINE_DOORS_MAPS_H_

#include <cstddef>
#include <cstdint>
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
#include "core/common/cache_budget.h"
#include "core/common/stop.h"
#include "core/engine/doors/map.h"
#include "core/engine/doors/map_reading.h"
#include "core/engine/doors/map_watch.h"
#include "core/engine/doors/open_maps.h"
#include "core/engine/doors/store_clocks.h"
#include "core/engine/jobs/jobs_elsewhere.h"
#include "core/engine/map/directory.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/map/map_stores.h"
#include "core/engine/map/numbers.h"
#include "core/engine/map/writer.h"
#include "core/storage/storage.h"

namespace strata {

class EngineMaps final : public api::Maps {
 public:
  // Opens no map yet; those that have something to do soon.
  static absl::StatusOr<std::unique_ptr<EngineMaps>> Open(const EngineOptions& options,
                                                          OpenStores open = OpenMapStores);

  // As OpenMaps::Find(); of shared stores the map shows what others may have seen of it.
  absl::StatusOr<std::shared_ptr<Map>> Find(const Stop& stop, absl::string_view name);

  // As FindToRead(), and where the map is here waits while its tiles are made again
  // (Worker::AwaitDerived).
  absl::StatusOr<MapReading> FindTilesToRead(const api::Call& call, absl::string_view name);
  // For calls that only read, and that the store itself can answer where another engine has the
  // map.
  absl::StatusOr<MapReading> FindToRead(const api::Call& call, absl::string_view name);

  // That jobs of the kind are run: by whom has the map, or by any that works. UNAVAILABLE.
  absl::Status CheckWorked(absl::string_view kind) const;
  // Of a call that was refused because another engine has the map: `refused`, or that none takes
  // it.
  absl::Status Refusal(absl::string_view name, const absl::Status& refused) const;
  // Returns once the map may not be at that commit and epoch any more.
  absl::Status AwaitNews(const MapReading& map,
                         std::uint64_t commit_sequence,
                         std::uint64_t epoch,
                         const Stop& stop);

  // The map where it is here; else its store, for what is decided in a commit while another engine
  // has the map (MapStores::OpenToAdd()): scans and jobs that come in here, edits of rows.
  struct Place {
    std::shared_ptr<Map> map;
    std::unique_ptr<MapStorage> store;

    // Runs `work` in a durable commit, and again where the store says so (StorageWriter::Commit).
    // `bytes` as of WriterThread::Run().
    absl::Status Commit(const Stop& stop, WriterThread::Work work, std::size_t bytes = 0) const;
    // Runs `body` on the newest state.
    absl::Status Read(absl::FunctionRef<absl::Status(StorageReader&)> body) const;
  };
  absl::StatusOr<Place> FindToAdd(const Stop& stop, absl::string_view name);
  // Has the map's worker carry it out, wherever that is: `place` as FindToAdd() found it. `stop` as
  // of Worker::Execute() and AskForEdit().
  absl::Status Edit(const Stop& stop,
                    absl::string_view name,
                    const Place& place,
                    const EditRequest& edit);
  const EngineOptions& options() const { return options_; }
  // Whether other engines use the same stores.
  bool IsShared() const { return stores_->IsShared(); }
  // Of all maps.
  const std::shared_ptr<CacheBudget>& caches() const { return maps_->caches(); }

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

  absl::Status DeleteHere(const Stop& stop, absl::string_view name);
  // Of a map that another engine has, as `refused` says.
  absl::Status DeleteElsewhere(const Stop& stop,
                               absl::string_view name,
                               const absl::Status& refused);
  // For an edit that waits for another engine: where nobody has the map any more this one takes it,
  // and finds the edit. UNAVAILABLE where none takes any.
  absl::Status CheckTaken(const Stop& stop, absl::string_view name);

  // Of a map that another engine has: whether it stands where the watcher was told, or did `lag`
  // ago at most.
  absl::StatusOr<bool> IsAt(absl::string_view name,
                            const MapWatcher& watcher,
                            absl::Duration lag,
                            const Stop& stop);
  // `here`: what Find() said.
  absl::StatusOr<MapReading> ToRead(absl::string_view name,
                                    absl::StatusOr<std::shared_ptr<Map>> here) const;

  const EngineOptions options_;
  const std::unique_ptr<const MapDirectory> directory_;
  const std::unique_ptr<const MapStores> stores_;
  const std::unique_ptr<OpenMaps> maps_;
  std::unique_ptr<JobsElsewhere> jobs_elsewhere_;  // of shared stores, where it works
  StoreClocks clocks_{*stores_};
  absl::Mutex removing_;  // one map's file is removed at a time
  mutable absl::Mutex mutex_;
  std::set<std::string, std::less<>> copied_
      ABSL_GUARDED_BY(mutex_);  // maps with a copy being made
  std::map<std::string, absl::Time, std::less<>> backed_up_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_MAPS_H_
