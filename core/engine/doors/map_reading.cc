#include "core/engine/doors/map_reading.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/map/reader_pool.h"

namespace strata {
namespace {

absl::Status ReadOne(StorageReader& reader, MapReading::Body body, MapClock& clock) {
  return reader.Snapshot([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(clock, reader.GetClock());
    return body(reader, clock);
  });
}

// What the store says changed after `since`.
absl::StatusOr<ChangeSet> ReadChanges(StorageReader& reader,
                                      std::uint64_t since,
                                      const MapClock& clock) {
  StoredChanges stored;
  stored.complete = since >= clock.commit_sequence;
  if (!stored.complete && since > 0) {
    STRATA_ASSIGN_OR_RETURN(stored, reader.ListChanges(since));
  }
  return ChangesOf(stored, clock.commit_sequence);
}

// Of a map that was opened after `since`: the store may know what its log does not. Else `state`.
absl::Status ReadLogged(MapCore& core,
                        std::uint64_t since,
                        MapState& state,
                        absl::FunctionRef<absl::Status(MapState&)> body) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  bool told = false;
  STRATA_RETURN_IF_ERROR(reader->Snapshot([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader->GetClock());
    STRATA_ASSIGN_OR_RETURN(ChangeSet changes, ReadChanges(*reader, since, clock));
    told = changes.complete;
    if (!told) return absl::OkStatus();
    MapState logged(*reader, clock, std::move(changes));
    return body(logged);
  }));
  return told ? absl::OkStatus() : body(state);
}

}  // namespace

absl::Status MapReading::ReadState(Body body) const {
  MapClock clock;
  if (map_ != nullptr) {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, map_->core().Reader());
    return ReadOne(*reader, body, clock);
  }
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<StorageReader> reader, store_->NewReader());
  return ReadOne(*reader, body, clock);
}

absl::Status MapReading::Read(const Stop& stop, Body body) const {
  MapClock seen;
  STRATA_RETURN_IF_ERROR(ReadState([&](StorageReader& reader, const MapClock& clock) {
    seen = clock;
    return body(reader, clock);
  }));
  if (map_ == nullptr) return absl::OkStatus();
  return map_->core().snapshots().AwaitPublished(seen.tile_version, stop);
}

absl::Status MapReading::CheckTiles(const MapClock& clock) const {
  if (clock.derived_complete) return absl::OkStatus();
  return Annotate(elsewhere_, "its tiles are being made again");
}

absl::Status MapReading::ReadTiles(Body body) const {
  return ReadState([&](StorageReader& reader, const MapClock& clock) -> absl::Status {
    STRATA_RETURN_IF_ERROR(CheckTiles(clock));
    return body(reader, clock);
  });
}

absl::Status MapReading::ReadStore(StorageReader& reader,
                                   std::uint64_t since,
                                   bool tiles,
                                   absl::FunctionRef<absl::Status(MapState&)> body) const {
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader.GetClock());
  if (tiles) STRATA_RETURN_IF_ERROR(CheckTiles(clock));
  STRATA_ASSIGN_OR_RETURN(ChangeSet changes, ReadChanges(reader, since, clock));
  MapState state(reader, clock, std::move(changes));
  return body(state);
}

absl::Status MapReading::ReadMap(std::uint64_t since,
                                 absl::FunctionRef<absl::Status(MapState&)> body) const {
  if (map_ == nullptr) {
    STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<StorageReader> reader, store_->NewReader());
    return reader->Snapshot([&] { return ReadStore(*reader, since, /*tiles=*/false, body); });
  }
  MapState state(map_->core(), since);
  if (state.changes().complete || since == 0) return body(state);
  return ReadLogged(map_->core(), since, state, body);
}

absl::Status MapReading::ReadMapTiles(std::uint64_t since,
                                      absl::FunctionRef<absl::Status(MapState&)> body) const {
  if (map_ != nullptr) return ReadMap(since, body);
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<StorageReader> reader, store_->NewReader());
  return reader->LongSnapshot([&] { return ReadStore(*reader, since, /*tiles=*/true, body); });
}

absl::Status MapReading::CopyTo(const std::filesystem::path& file, const Stop& stop) const {
  if (map_ != nullptr) {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, map_->core().Reader());
    return reader->CopyTo(file, stop);
  }
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<StorageReader> reader, store_->NewReader());
  return reader->CopyTo(file, stop);
}

}  // namespace strata
