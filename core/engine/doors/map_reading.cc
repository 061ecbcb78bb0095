#include "core/engine/doors/map_reading.h"

#include <memory>

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

absl::Status MapReading::ReadTiles(Body body) const {
  return ReadState([&](StorageReader& reader, const MapClock& clock) -> absl::Status {
    if (!clock.derived_complete) return Annotate(elsewhere_, "its tiles are being made again");
    return body(reader, clock);
  });
}

}  // namespace strata
