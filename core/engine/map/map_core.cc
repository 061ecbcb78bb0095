#include "core/engine/map/map_core.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

absl::Status ClearLeftovers(StorageWriter& writer) {
  return writer.Commit(Durability::kFull, [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const MapClock clock, writer.reader().GetClock());
    STRATA_RETURN_IF_ERROR(writer.AbandonOrphans());
    STRATA_RETURN_IF_ERROR(writer.DiscardUnpublished());
    return writer.CollectAllSurfaceTiles(clock.tile_version);
  });
}

}  // namespace

absl::StatusOr<std::unique_ptr<MapCore>> MapCore::Open(const std::string& name,
                                                       const std::filesystem::path& file,
                                                       const EngineOptions& options,
                                                       std::shared_ptr<CacheBudget> caches) {
  STRATA_ASSIGN_OR_RETURN(StoredMap stored, OpenMapFile(file, options));
  return Open(name, std::move(stored), options, std::move(caches));
}

absl::StatusOr<std::unique_ptr<MapCore>> MapCore::Open(const std::string& name,
                                                       StoredMap stored,
                                                       const EngineOptions& options,
                                                       std::shared_ptr<CacheBudget> caches) {
  StorageWriter& writer = stored.storage->writer();
  STRATA_RETURN_IF_ERROR(ClearLeftovers(writer));
  STRATA_ASSIGN_OR_RETURN(MapInfo info, writer.reader().GetMapInfo());
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, writer.reader().GetClock());
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t last_upload, writer.reader().LastUpload());
  info.name = name;
  return std::unique_ptr<MapCore>(new MapCore(name,
                                              stored.file,
                                              options,
                                              std::move(caches),
                                              std::move(stored.storage),
                                              std::move(info),
                                              clock,
                                              last_upload));
}

MapCore::MapCore(std::string name,
                 const std::filesystem::path& file,
                 const EngineOptions& options,
                 std::shared_ptr<CacheBudget> caches,
                 std::unique_ptr<MapStorage> storage,
                 MapInfo info,
                 const MapClock& clock,
                 std::uint64_t last_upload)
    : name_(std::move(name)),
      disk_(file),
      options_(options),
      caches_(std::move(caches)),
      info_(std::move(info)),
      storage_(std::move(storage)),
      snapshots_({clock.epoch, clock.tile_version}),
      changes_(clock.commit_sequence),
      readers_(*storage_),
      writer_(storage_->writer(), disk_, options.queue_bytes),
      last_upload_(last_upload) {}

MapInfo MapCore::info() const {
  absl::MutexLock lock(&mutex_);
  return info_;
}

absl::Status MapCore::CheckInPlace() const {
  absl::MutexLock lock(&mutex_);
  return storage_ == nullptr ? absl::OkStatus() : storage_->CheckInPlace();
}

void MapCore::set_default_profile(const RobotProfile& profile) {
  absl::MutexLock lock(&mutex_);
  info_.parameters.default_profile = profile;
}

void MapCore::set_origin(const GeodeticOrigin& origin) {
  absl::MutexLock lock(&mutex_);
  info_.parameters.origin = origin;
}

void MapCore::NoteUnreadable(const TileKey& key) {
  absl::MutexLock lock(&mutex_);
  unreadable_.insert(key);
}

absl::btree_set<TileKey> MapCore::TakeUnreadable() {
  absl::MutexLock lock(&mutex_);
  return std::exchange(unreadable_, {});
}

std::pair<ChangeSet, Snapshots::Pin> MapCore::ChangesSince(std::uint64_t commit_sequence) {
  absl::MutexLock lock(&publishing_);
  return {changes_.Since(commit_sequence), snapshots_.PinCurrent()};
}

absl::Status MapCore::Publish(const std::vector<ScanId>& scans,
                              const std::vector<api::TileChangeNotice>& tiles,
                              bool awaited,
                              absl::FunctionRef<absl::Status(StorageWriter&)> work) {
  MapClock clock;
  const auto publish = [&](StorageWriter& writer) -> absl::Status {
    STRATA_RETURN_IF_ERROR(work(writer));
    // Scans that were acknowledged since the version was chosen have numbers that watchers know,
    // and whoever knows a number is told of later ones only.
    STRATA_RETURN_IF_ERROR(writer.NextCommitSequence().status());
    STRATA_ASSIGN_OR_RETURN(clock, writer.reader().GetClock());
    return absl::OkStatus();
  };
  const auto show = [&] { Show(clock, scans, tiles); };
  // Durable: what a reader saw of a version must not be given again with other bytes.
  return awaited ? writer_.Run(Durability::kFull, 0, Stop(), publish, show)
                 : writer_.RunBehind(publish, show);
}

void MapCore::Show(const MapClock& clock,
                   const std::vector<ScanId>& scans,
                   const std::vector<api::TileChangeNotice>& tiles) {
  absl::MutexLock lock(&publishing_);
  snapshots_.Publish({clock.epoch, clock.tile_version});
  changes_.Add(clock.commit_sequence, scans, tiles);
}

void MapCore::Close() {
  writer_.Close();
  readers_.Close();
  absl::MutexLock lock(&mutex_);
  storage_.reset();
}

}  // namespace strata
