// What everything that works on one map shares: its store, its writer, its readers, its clock.
#ifndef STRATA_CORE_ENGINE_MAP_MAP_CORE_H_
#define STRATA_CORE_ENGINE_MAP_MAP_CORE_H_

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "core/common/cache_budget.h"
#include "core/engine/map/change_log.h"
#include "core/engine/map/disk_space.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/map/map_stores.h"
#include "core/engine/map/reader_pool.h"
#include "core/engine/map/snapshots.h"
#include "core/engine/map/writer.h"
#include "core/mls/tile_key.h"
#include "core/storage/storage.h"
#include "core/world/map_info.h"

namespace strata {

// What calls of a map that is being closed end with. Made once: want of memory closes maps, too,
// and destructors do.
const absl::Status& BeingClosed();

// Thread-safe.
class MapCore {
 public:
  // Clears what a crash left half-done in the map. `caches`: of all maps.
  static absl::StatusOr<std::unique_ptr<MapCore>> Open(const std::string& name,
                                                       StoredMap stored,
                                                       const EngineOptions& options,
                                                       std::shared_ptr<CacheBudget> caches);
  // The same of a map in a file.
  static absl::StatusOr<std::unique_ptr<MapCore>> Open(const std::string& name,
                                                       const std::filesystem::path& file,
                                                       const EngineOptions& options,
                                                       std::shared_ptr<CacheBudget> caches);
  // For a job that runs while another engine has the map: clears nothing, and what the other
  // publishes meanwhile is not seen. What it publishes of things (NoteInferred()) it asks the other
  // to tell, in the same commit. `stored` as of MapStores::OpenToWork().
  static absl::StatusOr<std::unique_ptr<MapCore>> OpenBeside(const std::string& name,
                                                             StoredMap stored,
                                                             const EngineOptions& options,
                                                             std::shared_ptr<CacheBudget> caches);
  ~MapCore() { Close(); }

  const std::string& name() const { return name_; }
  const EngineOptions& options() const { return options_; }
  const std::shared_ptr<CacheBudget>& caches() const { return caches_; }
  MapInfo info() const;
  void set_default_profile(const RobotProfile& profile);
  void set_origin(const GeodeticOrigin& origin);
  // As others have set it in the store.
  absl::Status TakeInOrigin();

  absl::StatusOr<ReaderPool::Lease> Reader() { return readers_.Take(); }
  WriterThread& writer() { return writer_; }
  // UNAVAILABLE once the map's file was removed or replaced; not of a map that is closed.
  absl::Status CheckInPlace() const;
  const DiskSpace& disk() const { return disk_; }
  Snapshots& snapshots() { return snapshots_; }
  ChangeLog& changes() { return changes_; }
  // What changed after a commit, and the state that it led to.
  std::pair<ChangeSet, Snapshots::Pin> ChangesSince(std::uint64_t commit_sequence);
  // Carries out `work` in a durable commit with a number of its own, one that nobody has been told
  // yet; then makes it the state that readers get and tells watchers of `scans` and `tiles`, as
  // one. Nothing has changed after an error. `awaited`: together with acknowledgements that wait;
  // else behind them.
  absl::Status Publish(const std::vector<ScanId>& scans,
                       const std::vector<api::TileChangeNotice>& tiles,
                       bool awaited,
                       absl::FunctionRef<absl::Status(StorageWriter&)> work);
  // Where others read the same store: returns once this process shows what they may have seen.
  // Costs nothing unless something is just being published.
  absl::Status AwaitShown(const Stop& stop);
  // Whether the store may hold tiles that were staged and neither published nor discarded.
  bool tiles_staged() const { return tiles_staged_; }
  void set_tiles_staged(bool staged) { tiles_staged_ = staged; }
  // How often what scans are has been edited: labels, what has faded, scans that are gone. Poses
  // and new scans are none.
  std::uint64_t edits() const { return edits_; }
  // After the edit was committed, if it was.
  void NoteEdit() { ++edits_; }
  // In the work of a Publish(): what is inferred may be another with it, of which watchers are
  // told.
  void NoteInferred() { inferred_changes_ = true; }
  // The same before it takes something away, where there is something.
  absl::Status NoteInferredIfAny(StorageReader& reader);
  // Of OpenBeside(): the last edit by which who has the map was asked to tell; 0: none.
  std::uint64_t asked_to_tell() const { return asked_to_tell_; }
  // A prepared tile that the store keeps is damaged.
  void NoteUnreadable(const TileKey& key);
  // Those noted since the last call.
  absl::btree_set<TileKey> TakeUnreadable();
  // A number for the chunks of one more upload, such that no process has another of it: the time in
  // milliseconds, so that those of one map lie beside each other, then random bits.
  static std::uint64_t NextUpload();

  // OK, or that the store may hold what nobody here knows (MustBeOpenedAnew()): the map has to be
  // closed and opened anew.
  absl::Status doubt() const;
  LastOwner last_owner() const { return last_owner_; }
  // As MapStorage::CheckHeld(); not of a map that is closed.
  absl::Status CheckHeld() const;
  // OK, or the status of Close(). For those who wait for what is in memory.
  absl::Status closed() const;
  // Ends the writer and closes all connections, waiting for reads under way; what is asked for
  // later gets `why`. Safe to call again.
  void Close(const absl::Status& why = BeingClosed());

 private:
  MapCore(std::string name,
          const std::filesystem::path& file,
          const EngineOptions& options,
          std::shared_ptr<CacheBudget> caches,
          std::unique_ptr<MapStorage> storage,
          MapInfo info,
          const MapClock& clock);
  static absl::StatusOr<std::unique_ptr<MapCore>> Make(const std::string& name,
                                                       StoredMap stored,
                                                       const EngineOptions& options,
                                                       std::shared_ptr<CacheBudget> caches);
  absl::Status AskToTell(StorageWriter& writer);
  // On the writer's thread, so that it happens in the order of commits.
  void Show(const MapClock& clock,
            const std::vector<ScanId>& scans,
            const std::vector<api::TileChangeNotice>& tiles);

  const std::string name_;
  const LastOwner last_owner_;
  const DiskSpace disk_;
  const EngineOptions options_;
  const std::shared_ptr<CacheBudget> caches_;
  mutable absl::Mutex mutex_;
  MapInfo info_ ABSL_GUARDED_BY(mutex_);
  absl::Status closed_ ABSL_GUARDED_BY(mutex_);
  absl::btree_set<TileKey> unreadable_ ABSL_GUARDED_BY(mutex_);
  std::unique_ptr<MapStorage> storage_;
  absl::Mutex publishing_;  // what snapshots_ and changes_ say is of one commit
  Snapshots snapshots_;
  ChangeLog changes_;
  ReaderPool readers_;
  WriterThread writer_;
  std::atomic<int> in_publication_ = 0;  // committed perhaps, and not shown
  std::atomic<bool> tiles_staged_ = false;
  std::atomic<std::uint64_t> edits_ = 0;
  std::atomic<bool> inferred_changes_ = false;  // since the last Show()
  bool beside_ = false;                         // another engine has the map
  std::atomic<std::uint64_t> asked_to_tell_ = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_MAP_CORE_H_
