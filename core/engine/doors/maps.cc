#include "core/engine/doors/maps.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <glog/logging.h>

#include "core/common/blocking.h"
#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/engine/doors/backup.h"
#include "core/engine/doors/map_stats.h"
#include "core/engine/doors/map_watch.h"
#include "core/engine/map/engine_options.h"
#include "core/world/job_kinds.h"
#include "core/world/names.h"

namespace strata {
namespace {

// Whether it was no fault of the file that it did not open.
bool MayOpenLater(const absl::Status& status) {
  return absl::IsResourceExhausted(status) || absl::IsUnavailable(status);
}

absl::Status NoSuchMap(absl::string_view name) {
  return absl::NotFoundError(absl::StrCat("map ", name.substr(0, 100), " does not exist"));
}

constexpr absl::Duration kRecently = absl::Seconds(10);

absl::Duration PendingAge(Map& map, StorageReader& reader) {
  ScanQuery query;
  query.state = ScanState::kPending;
  query.skip_damaged = true;  // it waits for ever, and verify names it
  query.limit = 1;
  const auto oldest = reader.ListScans(query, map.core().snapshots().current().epoch);
  if (!oldest.ok() || oldest->empty()) return absl::ZeroDuration();
  return SteadyNow() - map.worker().WaitingSince(oldest->front().scan.number);
}

// Numbers that cannot be read now stay zero: they are looked at again in some seconds.
MapNumbers NumbersOfMap(Map& map, const std::filesystem::path& file) {
  MapNumbers numbers;
  numbers.map = map.core().name();
  // A database does not say what a map takes of it.
  for (const char* suffix : {"", "-wal"}) {
    if (file.empty()) break;
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(file.string() + suffix, error);
    if (error) continue;
    numbers.file_bytes += bytes;
    if (*suffix != '\0') numbers.journal_bytes = bytes;
  }
  const WriterNumbers writer = map.core().writer().numbers();
  numbers.commits = writer.commits;
  numbers.commit_parts = writer.parts;
  numbers.commit_time = writer.time;
  numbers.queued_bytes = writer.queued_bytes;
  for (const JobInfo& job : map.jobs().List()) {
    ++numbers.jobs[{job.kind, job.state}];
    if (job.kind != kVerifyJob || job.state != JobState::kSucceeded) continue;
    numbers.verified = std::max(numbers.verified, job.updated);
  }
  const auto reader = map.core().Reader();
  if (!reader.ok()) return numbers;
  if (const auto totals = (*reader)->GetScanTotals(); totals.ok()) {
    numbers.scans = totals->scans;
    numbers.scans_pending = totals->pending;
    numbers.scans_failed = totals->failed;
  }
  if (numbers.scans_pending > 0) numbers.pending_age = PendingAge(map, **reader);
  const auto tiles = (*reader)->ListMlsTiles(map.core().snapshots().current().tile_version);
  if (tiles.ok()) numbers.tiles = tiles->size();
  return numbers;
}

}  // namespace

EngineNumbers EngineMaps::Numbers() const {
  std::vector<std::shared_ptr<Map>> open;
  EngineNumbers numbers;
  {
    absl::MutexLock lock(&mutex_);
    for (const auto& [name, map] : maps_) {
      if (map.ok()) {
        open.push_back(*map);
      } else {
        ++numbers.maps_not_opened;
      }
    }
  }
  for (const std::shared_ptr<Map>& map : open) {
    const std::string& name = map->core().name();
    numbers.maps.push_back(NumbersOfMap(*map, stores_->FileOf(name)));
    absl::MutexLock lock(&mutex_);
    const auto backed_up = backed_up_.find(name);
    if (backed_up != backed_up_.end()) numbers.maps.back().backed_up = backed_up->second;
  }
  return numbers;
}

EngineHealth EngineMaps::Health() const {
  EngineHealth health;
  std::vector<std::shared_ptr<Map>> open;
  {
    absl::MutexLock lock(&mutex_);
    for (const auto& [name, map] : maps_) {
      if (map.ok()) {
        open.push_back(*map);
      } else if (!absl::IsAborted(map.status())) {  // being made or deleted
        health.maps_not_opened.push_back(name);
      }
    }
  }
  for (const std::shared_ptr<Map>& map : open) {
    const std::string& name = map->core().name();
    if (const absl::Status taken = map->core().CheckInPlace(); !taken.ok()) {
      health.maps_taken_away.push_back(absl::StrCat(name, ": ", taken.message()));
      continue;  // which is why it is not written
    }
    const absl::Status failed = map->core().writer().FailedWithin(kRecently);
    if (failed.ok() || absl::IsResourceExhausted(failed)) continue;
    health.maps_not_written.push_back(absl::StrCat(name, ": ", failed.message()));
  }
  std::error_code error;
  const std::filesystem::space_info disk = std::filesystem::space(options_.directory, error);
  if (error) return health;
  health.disk_bytes = disk.capacity;
  health.disk_free_bytes = disk.available;
  return health;
}

// The one copy of a map that may be made at a time, from before the map's own file to after it.
class EngineMaps::CopyTurn {
 public:
  CopyTurn(EngineMaps& maps, absl::string_view name) : maps_(maps), name_(name) {
    absl::MutexLock lock(&maps_.mutex_);
    taken_ = maps_.copied_.insert(name_).second;
  }
  ~CopyTurn() {
    if (!taken_) return;
    absl::MutexLock lock(&maps_.mutex_);
    maps_.copied_.erase(name_);
  }
  CopyTurn(const CopyTurn&) = delete;
  CopyTurn& operator=(const CopyTurn&) = delete;
  bool taken() const { return taken_; }

 private:
  EngineMaps& maps_;
  const std::string name_;
  bool taken_ = false;
};

absl::StatusOr<std::unique_ptr<EngineMaps>> EngineMaps::Open(const EngineOptions& options) {
  STRATA_ASSIGN_OR_RETURN(MapDirectory owned, MapDirectory::Open(options.directory));
  auto directory = std::make_unique<const MapDirectory>(std::move(owned));
  STRATA_ASSIGN_OR_RETURN(std::unique_ptr<const MapStores> stores,
                          OpenMapStores(options, *directory));
  STRATA_ASSIGN_OR_RETURN(const std::vector<std::string> names, stores->List());
  std::unique_ptr<EngineMaps> maps(
      new EngineMaps(options, std::move(directory), std::move(stores)));
  absl::MutexLock lock(&maps->mutex_);
  for (const std::string& name : names) maps->maps_.emplace(name, maps->OpenMap(name));
  return maps;
}

absl::StatusOr<std::shared_ptr<Map>> EngineMaps::OpenMap(const std::string& name) const {
  absl::StatusOr<StoredMap> stored = stores_->Open(name);
  absl::StatusOr<std::shared_ptr<Map>> map =
      stored.ok() ? Map::Open(name, *std::move(stored), options_, caches_) : stored.status();
  if (!map.ok()) {
    LOG(ERROR) << LogLine("map").Add("map", name).Add("not_opened", map.status().message());
  }
  return map;
}

absl::StatusOr<std::shared_ptr<Map>> EngineMaps::Find(absl::string_view name) {
  STRATA_RETURN_IF_ERROR(ValidateName("map name", name));
  const std::string key(name);
  {
    absl::MutexLock lock(&mutex_);
    const auto it = maps_.find(key);
    if (it == maps_.end()) return NoSuchMap(name);
    if (it->second.ok() || !MayOpenLater(it->second.status())) return it->second;
    absl::Time& next_try = next_try_[key];
    if (SteadyNow() < next_try || !opening_.insert(key).second) return it->second;
    next_try = SteadyNow() + kRetryDelay;
  }
  return OpenAgain(key);
}

absl::StatusOr<std::shared_ptr<Map>> EngineMaps::FindWithTiles(const api::Call& call,
                                                               absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(std::shared_ptr<Map> map, Find(name));
  STRATA_RETURN_IF_ERROR(map->worker().AwaitDerived(call.stop));
  return map;
}

absl::StatusOr<std::shared_ptr<Map>> EngineMaps::OpenAgain(const std::string& name) {
  absl::StatusOr<std::shared_ptr<Map>> map = OpenMap(name);
  absl::MutexLock lock(&mutex_);
  opening_.erase(name);
  maps_.insert_or_assign(name, map);
  return map;
}

absl::StatusOr<MapInfo> EngineMaps::Create(const api::Call& call,
                                           absl::string_view name,
                                           const MapParameters& parameters) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_RETURN_IF_ERROR(ValidateName("map name", name));
  STRATA_RETURN_IF_ERROR(ValidateMapParameters(parameters));
  const std::string key(name);
  STRATA_RETURN_IF_ERROR(Reserve(key));
  // Without the lock: every call looks for its map, and this waits for the disk.
  const absl::Status made = stores_->Create(key, parameters, absl::Now());
  const absl::StatusOr<std::shared_ptr<Map>> map = made.ok() ? OpenMap(key) : made;
  // Nobody has put anything into one that does not open.
  const bool stays = map.ok() || (made.ok() && !stores_->Delete(key, 0).ok());
  absl::MutexLock lock(&mutex_);
  if (stays) {
    maps_.insert_or_assign(key, map);
  } else {
    maps_.erase(key);
  }
  STRATA_RETURN_IF_ERROR(map.status());
  return (*map)->core().info();
}

absl::Status EngineMaps::Reserve(const std::string& name) {
  absl::MutexLock lock(&mutex_);
  if (maps_.contains(name)) return absl::AlreadyExistsError(absl::StrCat("map ", name, " exists"));
  if (maps_.size() >= options_.max_maps) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "there are ", maps_.size(), " maps, the most this server holds; delete one first"));
  }
  maps_.emplace(name, absl::AbortedError(absl::StrCat("map ", name, " is being made")));
  return absl::OkStatus();
}

absl::StatusOr<MapInfo> EngineMaps::Get(const api::Call& call, absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> map, Find(name));
  return map->core().info();
}

absl::StatusOr<std::vector<MapInfo>> EngineMaps::List(const api::Call& call) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  std::vector<MapInfo> infos;
  absl::MutexLock lock(&mutex_);
  for (const auto& [name, map] : maps_) {
    if (map.ok()) infos.push_back((*map)->core().info());
  }
  return infos;
}

absl::StatusOr<std::shared_ptr<Map>> EngineMaps::Withdraw(absl::string_view name) {
  absl::MutexLock lock(&mutex_);
  const auto it = maps_.find(std::string(name));
  if (it == maps_.end()) return NoSuchMap(name);
  std::shared_ptr<Map> map;
  if (it->second.ok()) {
    map = *it->second;  // its jobs end with it
  } else if (absl::IsAborted(it->second.status())) {
    return NoSuchMap(name);
  } else if (opening_.contains(it->first)) {
    return absl::AbortedError(absl::StrCat("map ", it->first, " is being opened; retry"));
  } else {
    STRATA_RETURN_IF_ERROR(stores_->CheckRemovable(name));
  }
  it->second = absl::AbortedError(absl::StrCat("map ", it->first, " is being deleted"));
  return map;
}

absl::Status EngineMaps::Delete(const api::Call& call, absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_RETURN_IF_ERROR(ValidateName("map name", name));
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> map, Withdraw(name));
  std::uint64_t clock = 0;
  if (map != nullptr) {
    const BlockingScope blocking;  // for what its threads are at
    map->Close();
    clock = map->core().changes().last();
  }
  absl::Status removed;
  {
    absl::MutexLock lock(&removing_);
    removed = stores_->Delete(name, clock);
  }
  absl::MutexLock lock(&mutex_);
  maps_.erase(std::string(name));
  backed_up_.erase(std::string(name));
  return removed;
}

absl::StatusOr<MapStats> EngineMaps::Stats(const api::Call& call, absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> map, Find(name));
  // It counts tiles, but says what there is of a map in quarantine, too.
  const absl::Status made = map->worker().AwaitDerived(call.stop);
  if (!absl::IsFailedPrecondition(made)) STRATA_RETURN_IF_ERROR(made);
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, map->core().Reader());
  STRATA_ASSIGN_OR_RETURN(MapStats stats, CollectStats(*reader));
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader->GetClock());
  map->core().snapshots().AwaitPublished(clock.tile_version);
  return stats;
}

absl::StatusOr<std::vector<EpochInfo>> EngineMaps::History(const api::Call& call,
                                                           absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> map, Find(name));
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, map->core().Reader());
  return reader->ListEpochs();
}

absl::StatusOr<std::vector<MapClass>> EngineMaps::ListClasses(const api::Call& call,
                                                              absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> map, Find(name));
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, map->core().Reader());
  return reader->ListClasses();
}

absl::Status EngineMaps::SetClass(const api::Call& call,
                                  absl::string_view name,
                                  const MapClass& map_class) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> map, Find(name));
  STRATA_RETURN_IF_ERROR(ValidateMapClass(map_class));
  return map->core().writer().Run(Durability::kFull, 0, call.stop, [&](StorageWriter& writer) {
    return writer.PutClass(map_class);
  });
}

absl::Status EngineMaps::SetOrigin(const api::Call& call,
                                   absl::string_view name,
                                   const GeodeticOrigin& origin) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> map, Find(name));
  STRATA_RETURN_IF_ERROR(ValidateGeodeticOrigin(origin));
  MapCore& core = map->core();
  return core.writer().Run(
      Durability::kFull,
      0,
      call.stop,
      [&](StorageWriter& writer) { return writer.PutOrigin(origin); },
      [&] { core.set_origin(origin); });
}

absl::Status EngineMaps::Watch(const api::Call& call,
                               absl::string_view name,
                               const api::WatchOptions& options,
                               absl::FunctionRef<absl::Status(const api::MapUpdate&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> map, Find(name));
  if (!options.trajectory.empty()) {
    STRATA_RETURN_IF_ERROR(ValidateName("trajectory name", options.trajectory));
  }
  return WatchMap(map->core(), call.stop, options, sink);
}

absl::Status EngineMaps::Backup(const api::Call& call,
                                absl::string_view name,
                                absl::FunctionRef<absl::Status(const api::BackupPiece&)> sink) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> map, Find(name));
  const CopyTurn turn(*this, name);
  if (!turn.taken()) {
    return absl::ResourceExhaustedError(
        absl::StrCat("map ", name, ": another backup of it runs; try again later"));
  }
  const absl::Status done = BackUp(map->core(), directory_->CopyOf(name), call.stop, sink);
  directory_->RemoveCopy(name)
      .IgnoreError();  // its journal, too; if this fails the next start does
  STRATA_RETURN_IF_ERROR(done);
  absl::MutexLock lock(&mutex_);
  backed_up_[std::string(name)] = absl::Now();
  return absl::OkStatus();
}

}  // namespace strata
