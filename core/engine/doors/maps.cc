#include "core/engine/doors/maps.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
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

#include "core/common/map_owner.h"
#include "core/common/status.h"
#include "core/engine/doors/backup.h"
#include "core/engine/ingest/edits.h"
#include "core/engine/jobs/job_handlers.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/tiles/map_stats.h"
#include "core/world/names.h"

namespace strata {
namespace {

constexpr absl::Duration kRecently = absl::Seconds(10);

}  // namespace

EngineNumbers EngineMaps::Numbers() const {
  EngineNumbers numbers = maps_->Numbers();
  absl::MutexLock lock(&mutex_);
  for (MapNumbers& map : numbers.maps) {
    const auto backed_up = backed_up_.find(map.map);
    if (backed_up != backed_up_.end()) map.backed_up = backed_up->second;
  }
  return numbers;
}

EngineHealth EngineMaps::Health() const {
  EngineHealth health;
  health.maps_not_opened = maps_->NotOpened();
  for (const std::shared_ptr<Map>& map : maps_->Open()) {
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

absl::StatusOr<std::unique_ptr<EngineMaps>> EngineMaps::Open(const EngineOptions& options,
                                                             OpenStores open) {
  STRATA_ASSIGN_OR_RETURN(MapDirectory owned, MapDirectory::Open(options.directory));
  auto directory = std::make_unique<const MapDirectory>(std::move(owned));
  STRATA_ASSIGN_OR_RETURN(std::unique_ptr<const MapStores> stores, open(options, *directory));
  STRATA_ASSIGN_OR_RETURN(std::unique_ptr<OpenMaps> maps, OpenMaps::Start(options, *stores));
  std::unique_ptr<EngineMaps> engine(
      new EngineMaps(options, std::move(directory), std::move(stores), std::move(maps)));
  if (options.works && engine->IsShared()) {
    STRATA_ASSIGN_OR_RETURN(std::string holder, engine->directory_->Identity());
    OpenMaps& all = *engine->maps_;
    engine->jobs_elsewhere_ = std::make_unique<JobsElsewhere>(
        options,
        *engine->stores_,
        all.caches(),
        std::move(holder),
        [&all](const std::string& name) { return all.IsOpen(name); });
  }
  return engine;
}

absl::Status EngineMaps::CheckWorked(absl::string_view kind) const {
  if (options_.works || !RunsAnywhere(kind)) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(const std::set<std::string> workers, stores_->ListWorkers());
  if (!workers.empty()) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(
      "no server on this store runs jobs of kind ", kind, ": start one with --role worker"));
}

absl::StatusOr<std::shared_ptr<Map>> EngineMaps::Find(const Stop& stop, absl::string_view name) {
  STRATA_ASSIGN_OR_RETURN(std::shared_ptr<Map> map, maps_->Find(stop, name));
  if (stores_->IsShared()) STRATA_RETURN_IF_ERROR(map->core().AwaitShown(stop));
  return map;
}

absl::StatusOr<MapReading> EngineMaps::FindToRead(const api::Call& call, absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  return ToRead(name, Find(call.stop, name));
}

absl::StatusOr<MapReading> EngineMaps::ToRead(absl::string_view name,
                                              absl::StatusOr<std::shared_ptr<Map>> here) const {
  if (here.ok()) return MapReading(*std::move(here));
  if (!MapOwnerOf(here.status()).has_value()) return here.status();
  STRATA_ASSIGN_OR_RETURN(std::unique_ptr<MapStorage> store, stores_->OpenToRead(name));
  return MapReading(std::string(name), std::move(store), here.status());
}

absl::Status EngineMaps::AwaitNews(const MapReading& map,
                                   std::uint64_t commit_sequence,
                                   std::uint64_t epoch,
                                   const Stop& stop) {
  if (map.map() != nullptr) return map.map()->core().changes().Await(commit_sequence, stop);
  return clocks_.Await(map.name(), commit_sequence, epoch, stop);
}

absl::StatusOr<EngineMaps::Place> EngineMaps::FindToAdd(const Stop& stop, absl::string_view name) {
  Place place;
  absl::StatusOr<std::shared_ptr<Map>> map = Find(stop, name);
  if (map.ok()) {
    place.map = *std::move(map);
    return place;
  }
  if (!MapOwnerOf(map.status()).has_value()) return map.status();
  absl::StatusOr<std::unique_ptr<MapStorage>> store =
      stores_->OpenToAdd(name, options_.max_pending_scans);
  // Nobody has it any more: this engine will, a moment later.
  if (absl::IsUnavailable(store.status())) return map.status();
  STRATA_ASSIGN_OR_RETURN(place.store, std::move(store));
  return place;
}

absl::Status EngineMaps::Place::Commit(const Stop& stop,
                                       WriterThread::Work work,
                                       std::size_t bytes) const {
  if (map != nullptr) return map->core().writer().Run(Durability::kFull, bytes, stop, work);
  StorageWriter& writer = store->writer();
  return writer.Commit(Durability::kFull, [&] { return work(writer); });
}

absl::Status EngineMaps::Place::Read(absl::FunctionRef<absl::Status(StorageReader&)> body) const {
  if (map != nullptr) {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, map->core().Reader());
    return body(*reader);
  }
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<StorageReader> reader, store->NewReader());
  return body(*reader);
}

absl::Status EngineMaps::Edit(const Stop& stop,
                              absl::string_view name,
                              const Place& place,
                              const EditRequest& edit) {
  if (place.map != nullptr) {
    // Those that were asked for before go first: one whose asker has died is not made later.
    std::uint64_t behind = 0;
    STRATA_RETURN_IF_ERROR(
        place.Read([&](StorageReader& reader) { return AssignTo(reader.LastEdit(), behind); }));
    return place.map->worker().Execute(
        stop,
        [&](Integrator& integrator) { return CarryOut(edit, integrator, stop); },
        "an edit",
        behind);
  }
  return AskForEdit(*place.store, edit, stop, [&] { return CheckTaken(stop, name); });
}

absl::Status EngineMaps::CheckTaken(const Stop& stop, absl::string_view name) {
  absl::Status here = maps_->Find(stop, name).status();
  if (absl::IsAborted(here)) return absl::OkStatus();  // it is being deleted here, as was asked
  return absl::IsUnavailable(here) ? stores_->CheckTaken(name) : here;
}

absl::Status EngineMaps::Refusal(absl::string_view name, const absl::Status& refused) const {
  if (!MapOwnerOf(refused).has_value()) return refused;
  STRATA_RETURN_IF_ERROR(stores_->CheckTaken(name));
  return refused;
}

absl::StatusOr<MapReading> EngineMaps::FindTilesToRead(const api::Call& call,
                                                       absl::string_view name) {
  STRATA_ASSIGN_OR_RETURN(MapReading found, FindToRead(call, name));
  if (found.map() != nullptr) {
    STRATA_RETURN_IF_ERROR(found.map()->worker().AwaitDerived(call.stop));
  }
  return found;
}

absl::StatusOr<MapInfo> EngineMaps::Create(const api::Call& call,
                                           absl::string_view name,
                                           const MapParameters& parameters) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_RETURN_IF_ERROR(ValidateName("map name", name));
  STRATA_RETURN_IF_ERROR(ValidateMapParameters(parameters));
  const std::string key(name);
  const absl::Time created = absl::FromUnixMicros(absl::ToUnixMicros(absl::Now()));
  bool made = false;
  const absl::Status opened = maps_->Make(call.stop, key, [&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(stores_->Create(key, parameters, created));
    made = true;
    return absl::OkStatus();
  });
  // It is there, even where there is no room to open it now.
  const bool later = absl::IsResourceExhausted(opened) || absl::IsUnavailable(opened);
  if (opened.ok() || (made && later)) return MapInfo{key, parameters, created};
  // Nobody has put anything into one that does not open.
  if (made) Delete(call, key).IgnoreError();
  return opened;
}

absl::StatusOr<MapInfo> EngineMaps::Get(const api::Call& call, absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const MapReading found, FindToRead(call, name));
  // Others may have given it another origin.
  if (found.map() != nullptr && !IsShared()) return found.map()->core().info();
  MapInfo info;
  STRATA_RETURN_IF_ERROR(found.ReadState(
      [&](StorageReader& reader, const MapClock&) { return AssignTo(reader.GetMapInfo(), info); }));
  info.name = std::string(name);
  return info;
}

absl::StatusOr<std::vector<MapInfo>> EngineMaps::List(const api::Call& call) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  return maps_->List(call.stop);
}

absl::Status EngineMaps::DeleteHere(const Stop& stop, absl::string_view name) {
  return maps_->Remove(stop, name, [&](std::uint64_t clock) -> absl::Status {
    absl::MutexLock lock(&removing_);
    STRATA_RETURN_IF_ERROR(stores_->CheckRemovable(name));
    return stores_->Delete(name, clock);
  });
}

// Its owner lets go of it first: once this returns nobody is served it any more, wherever he asks.
absl::Status EngineMaps::DeleteElsewhere(const Stop& stop,
                                         absl::string_view name,
                                         const absl::Status& refused) {
  const absl::StatusOr<std::unique_ptr<MapStorage>> store =
      stores_->OpenToAdd(name, options_.max_pending_scans);
  if (absl::IsUnavailable(store.status())) return refused;  // he has left
  STRATA_RETURN_IF_ERROR(store.status());
  const absl::Status asked =
      AskForEdit(**store, DeletingMap(), stop, [&] { return CheckTaken(stop, name); });
  if (!absl::IsNotFound(asked)) return asked;
  maps_->ForgetIfGone(std::string(name));
  return stores_->FinishDeletions();
}

absl::Status EngineMaps::Delete(const api::Call& call, absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_RETURN_IF_ERROR(ValidateName("map name", name));
  // Another engine may have made it, or have it.
  absl::Status deleted = IsShared() ? maps_->Find(call.stop, name).status() : absl::OkStatus();
  if (MapOwnerOf(deleted).has_value()) {
    deleted = DeleteElsewhere(call.stop, name, deleted);
  } else if (!absl::IsNotFound(deleted)) {
    deleted = DeleteHere(call.stop, name);
  }
  STRATA_RETURN_IF_ERROR(deleted);
  absl::MutexLock lock(&mutex_);
  backed_up_.erase(std::string(name));
  return absl::OkStatus();
}

absl::StatusOr<MapStats> EngineMaps::Stats(const api::Call& call, absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const MapReading found, FindToRead(call, name));
  if (found.map() != nullptr) {
    // It counts tiles, but says what there is of a map in quarantine, too.
    const absl::Status made = found.map()->worker().AwaitDerived(call.stop);
    if (!absl::IsFailedPrecondition(made)) STRATA_RETURN_IF_ERROR(made);
  }
  MapStats stats;
  STRATA_RETURN_IF_ERROR(found.Read(call.stop, [&](StorageReader& reader, const MapClock& clock) {
    return AssignTo(CollectStats(reader, clock), stats);
  }));
  return stats;
}

absl::StatusOr<std::vector<EpochInfo>> EngineMaps::History(const api::Call& call,
                                                           absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const MapReading found, FindToRead(call, name));
  std::vector<EpochInfo> epochs;
  STRATA_RETURN_IF_ERROR(found.ReadState([&](StorageReader& reader, const MapClock&) {
    return AssignTo(reader.ListEpochs(), epochs);
  }));
  return epochs;
}

absl::StatusOr<std::vector<MapClass>> EngineMaps::ListClasses(const api::Call& call,
                                                              absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const MapReading found, FindToRead(call, name));
  std::vector<MapClass> classes;
  STRATA_RETURN_IF_ERROR(found.ReadState([&](StorageReader& reader, const MapClock&) {
    return AssignTo(reader.ListClasses(), classes);
  }));
  return classes;
}

absl::Status EngineMaps::SetClass(const api::Call& call,
                                  absl::string_view name,
                                  const MapClass& map_class) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const Place place, FindToAdd(call.stop, name));
  STRATA_RETURN_IF_ERROR(ValidateMapClass(map_class));
  return place.Commit(call.stop, [&](StorageWriter& writer) { return writer.PutClass(map_class); });
}

absl::Status EngineMaps::SetOrigin(const api::Call& call,
                                   absl::string_view name,
                                   const GeodeticOrigin& origin) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const Place place, FindToAdd(call.stop, name));
  STRATA_RETURN_IF_ERROR(ValidateGeodeticOrigin(origin));
  const auto put = [&](StorageWriter& writer) { return writer.PutOrigin(origin); };
  if (place.map == nullptr) return place.Commit(call.stop, put);
  MapCore& core = place.map->core();
  return core.writer().Run(Durability::kFull, 0, call.stop, put, [&] { core.set_origin(origin); });
}

absl::StatusOr<bool> EngineMaps::IsAt(absl::string_view name,
                                      const MapWatcher& watcher,
                                      absl::Duration lag,
                                      const Stop& stop) {
  if (lag <= absl::ZeroDuration()) return false;
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, clocks_.ClockOf(std::string(name), lag, stop));
  return clock.commit_sequence == watcher.since() && clock.epoch == watcher.epoch();
}

absl::Status EngineMaps::Watch(const api::Call& call,
                               absl::string_view name,
                               const api::WatchOptions& options,
                               absl::FunctionRef<absl::Status(const api::MapUpdate&)> sink) {
  if (!options.trajectory.empty()) {
    STRATA_RETURN_IF_ERROR(ValidateName("trajectory name", options.trajectory));
  }
  MapWatcher watcher(options);
  while (true) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    absl::StatusOr<std::shared_ptr<Map>> here = Find(call.stop, name);
    if (MapOwnerOf(here.status()).has_value()) {
      STRATA_ASSIGN_OR_RETURN(const bool known, IsAt(name, watcher, options.lag, call.stop));
      if (known) return sink(watcher.Nothing());
    }
    STRATA_ASSIGN_OR_RETURN(const MapReading found, ToRead(name, std::move(here)));
    std::optional<api::MapUpdate> update;
    STRATA_RETURN_IF_ERROR(found.ReadMap(
        watcher.since(), [&](MapState& state) { return AssignTo(watcher.Next(state), update); }));
    if (update.has_value()) STRATA_RETURN_IF_ERROR(sink(*update));
    if (options.once) return absl::OkStatus();
    STRATA_RETURN_IF_ERROR(AwaitNews(found, watcher.since(), watcher.epoch(), call.stop));
  }
}

absl::Status EngineMaps::Backup(const api::Call& call,
                                absl::string_view name,
                                absl::FunctionRef<absl::Status(const api::BackupPiece&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, FindToRead(call, name));
  const CopyTurn turn(*this, name);
  if (!turn.taken()) {
    return absl::ResourceExhaustedError(
        absl::StrCat("map ", name, ": another backup of it runs; try again later"));
  }
  const auto copy = [&](const std::filesystem::path& file) {
    return found.CopyTo(file, call.stop);
  };
  const absl::Status done = BackUp(copy, directory_->CopyOf(name), call.stop, sink);
  directory_->RemoveCopy(name)
      .IgnoreError();  // its journal, too; if this fails the next start does
  STRATA_RETURN_IF_ERROR(done);
  absl::MutexLock lock(&mutex_);
  backed_up_[std::string(name)] = absl::Now();
  return absl::OkStatus();
}

}  // namespace strata
