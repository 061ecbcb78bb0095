#include "core/engine/map/map_core.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/random/random.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/retry_delay.h"
#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/storage/outcome.h"
#include "core/storage/storage.h"

namespace strata {

const absl::Status& BeingClosed() {
  static const auto* const closed =
      new absl::Status(absl::StatusCode::kCancelled, "the map is being closed");
  return *closed;
}
namespace {

std::vector<StoredChange> StoredChangesOf(std::uint64_t commit_sequence,
                                          const std::vector<ScanId>& scans,
                                          const std::vector<api::TileChangeNotice>& tiles,
                                          bool inferred) {
  std::vector<StoredChange> changes;
  changes.reserve(scans.size() + tiles.size() + 1);
  for (const ScanId& scan : scans) changes.push_back({commit_sequence, scan, {}, 0, false, false});
  for (const api::TileChangeNotice& tile : tiles) {
    changes.push_back({commit_sequence, {}, tile.key, tile.version, tile.gone, false});
  }
  if (inferred) changes.push_back({commit_sequence, {}, {}, 0, false, true});
  return changes;
}

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
  STRATA_RETURN_IF_ERROR(ClearLeftovers(stored.storage->writer()));
  return Make(name, std::move(stored), options, std::move(caches));
}

absl::StatusOr<std::unique_ptr<MapCore>> MapCore::OpenBeside(const std::string& name,
                                                             StoredMap stored,
                                                             const EngineOptions& options,
                                                             std::shared_ptr<CacheBudget> caches) {
  STRATA_ASSIGN_OR_RETURN(std::unique_ptr<MapCore> core,
                          Make(name, std::move(stored), options, std::move(caches)));
  core->beside_ = true;
  return core;
}

absl::StatusOr<std::unique_ptr<MapCore>> MapCore::Make(const std::string& name,
                                                       StoredMap stored,
                                                       const EngineOptions& options,
                                                       std::shared_ptr<CacheBudget> caches) {
  StorageWriter& writer = stored.storage->writer();
  STRATA_ASSIGN_OR_RETURN(MapInfo info, writer.reader().GetMapInfo());
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, writer.reader().GetClock());
  info.name = name;
  return std::unique_ptr<MapCore>(new MapCore(name,
                                              stored.file,
                                              options,
                                              std::move(caches),
                                              std::move(stored.storage),
                                              std::move(info),
                                              clock));
}

MapCore::MapCore(std::string name,
                 const std::filesystem::path& file,
                 const EngineOptions& options,
                 std::shared_ptr<CacheBudget> caches,
                 std::unique_ptr<MapStorage> storage,
                 MapInfo info,
                 const MapClock& clock)
    : name_(std::move(name)),
      last_owner_(storage->last_owner()),
      disk_(file),
      options_(options),
      caches_(std::move(caches)),
      info_(std::move(info)),
      storage_(std::move(storage)),
      snapshots_({clock.epoch, clock.tile_version}),
      changes_(clock.commit_sequence),
      readers_(*storage_),
      writer_(storage_->writer(), disk_, options.queue_bytes) {}

MapInfo MapCore::info() const {
  absl::MutexLock lock(&mutex_);
  return info_;
}

absl::Status MapCore::CheckInPlace() const {
  absl::MutexLock lock(&mutex_);
  return storage_ == nullptr ? absl::OkStatus() : storage_->CheckInPlace();
}

absl::Status MapCore::CheckHeld() const {
  absl::MutexLock lock(&mutex_);
  return storage_ == nullptr ? absl::OkStatus() : storage_->CheckHeld();
}

absl::Status MapCore::doubt() const {
  STRATA_RETURN_IF_ERROR(writer_.doubt());
  const absl::Status held = CheckHeld();
  return MustBeOpenedAnew(held) ? WithRetryDelay(held, kRetryDelay) : absl::OkStatus();
}

void MapCore::set_default_profile(const RobotProfile& profile) {
  absl::MutexLock lock(&mutex_);
  info_.parameters.default_profile = profile;
}

void MapCore::set_origin(const GeodeticOrigin& origin) {
  absl::MutexLock lock(&mutex_);
  info_.parameters.origin = origin;
}

// On the writer's thread, so that none of this process that is newer is lost.
absl::Status MapCore::TakeInOrigin() {
  MapInfo stored;
  const auto read = [&](StorageWriter& writer) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(stored, writer.reader().GetMapInfo());
    return absl::OkStatus();
  };
  return writer_.Run(Durability::kRelaxed, 0, Stop(), read, [&] {
    absl::MutexLock lock(&mutex_);
    info_.parameters.origin = stored.parameters.origin;
  });
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
    if (beside_ && inferred_changes_) STRATA_RETURN_IF_ERROR(AskToTell(writer));
    return writer.PutChanges(
        StoredChangesOf(clock.commit_sequence, scans, tiles, inferred_changes_));
  };
  const auto show = [&] { Show(clock, scans, tiles); };
  ++in_publication_;
  const absl::Cleanup shown = [this] { --in_publication_; };
  // Durable: what a reader saw of a version must not be given again with other bytes.
  return awaited ? writer_.Run(Durability::kFull, 0, Stop(), publish, show)
                 : writer_.RunBehind(publish, show);
}

// Others are told by the store, but who has the map tells by what it knows, and may have given its
// watchers a later number than this one already: so it takes another.
absl::Status MapCore::AskToTell(StorageWriter& writer) {
  EditRequest edit;
  edit.kind = EditKind::kTellInferred;
  STRATA_ASSIGN_OR_RETURN(asked_to_tell_, writer.PutEdit(edit));
  return absl::OkStatus();
}

absl::Status MapCore::AwaitShown(const Stop& stop) {
  if (in_publication_ == 0) return absl::OkStatus();
  MapClock clock;
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, Reader());
    STRATA_ASSIGN_OR_RETURN(clock, reader->GetClock());
  }
  return snapshots_.AwaitPublished(clock.tile_version, stop);
}

void MapCore::Show(const MapClock& clock,
                   const std::vector<ScanId>& scans,
                   const std::vector<api::TileChangeNotice>& tiles) {
  absl::MutexLock lock(&publishing_);
  snapshots_.Publish({clock.epoch, clock.tile_version});
  changes_.Add(clock.commit_sequence, scans, tiles, inferred_changes_);
  inferred_changes_ = false;  // on the writer's thread, as where it is noted
}

absl::Status MapCore::NoteInferredIfAny(StorageReader& reader) {
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t job, reader.JobOfInferred());
  if (job != 0) NoteInferred();
  return absl::OkStatus();
}

std::uint64_t MapCore::NextUpload() {
  constexpr int kRandomBits = 22;  // 41 are left to the time, until 2039
  thread_local absl::BitGen random;
  const auto ms = static_cast<std::uint64_t>(absl::ToUnixMillis(absl::Now()));
  const auto low = absl::Uniform<std::uint64_t>(random, 0, std::uint64_t{1} << kRandomBits);
  constexpr std::uint64_t kMost = (std::uint64_t{1} << 63) - 1;  // as columns hold it
  return std::max<std::uint64_t>(1, (ms << kRandomBits | low) & kMost);
}

absl::Status MapCore::closed() const {
  absl::MutexLock lock(&mutex_);
  return closed_;
}

void MapCore::Close(const absl::Status& why) {
  {
    absl::MutexLock lock(&mutex_);
    if (closed_.ok()) closed_ = why;
  }
  writer_.Close();
  snapshots_.Close(why);
  changes_.Close(why);
  readers_.Close(why);
  absl::MutexLock lock(&mutex_);
  storage_.reset();
}

}  // namespace strata
