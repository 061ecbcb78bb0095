#include "core/engine/ingest/scans_ahead.h"

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/codec/local_map_codec.h"
#include "core/common/status.h"
#include "core/engine/scans/matching.h"
#include "core/engine/scans/scan_losses.h"
#include "core/engine/scans/scan_share.h"
#include "core/engine/tiles/mls_tiles.h"

namespace strata {

ScansAhead::ScansAhead(MapCore& core, std::span<const PosedScan> scans)
    : core_(core), scans_(scans), parameters_(core.info().parameters) {}

absl::Status ScansAhead::Make(std::size_t i) {
  Slot& slot = SlotOf(i);
  slot.made = ReadyScan();
  if (!slot.source.has_value()) {
    STRATA_ASSIGN_OR_RETURN(ReaderPool::Lease reader, core_.Reader());
    slot.reader.emplace(std::move(reader));
    slot.source.emplace(**slot.reader, parameters_);
  }
  const ScanRecord& scan = scans_[i].scan;
  ScanSource& source = *slot.source;
  STRATA_ASSIGN_OR_RETURN(MlsMap local_map, source.LocalMap(scan));
  STRATA_RETURN_IF_ERROR(CheckContributes(
      local_map, source.dropped(), scan, scan.header.sensor.value_or(parameters_.sensor)));
  if (!parameters_.keep_points) {
    STRATA_RETURN_IF_ERROR(CheckRoomInTiles(local_map, {}));
    STRATA_ASSIGN_OR_RETURN(slot.made.local_map, EncodeLocalMap(local_map));
  }
  STRATA_ASSIGN_OR_RETURN(const bool otherwise, source.IsMatchedOtherwise(scan));
  if (otherwise) {
    STRATA_ASSIGN_OR_RETURN(local_map, source.RegistrationMap(scan));
  }
  STRATA_ASSIGN_OR_RETURN(ScanFeatures features,
                          source.Features(scan, local_map, FeatureOptionsOf(scan)));
  slot.made.features = std::make_shared<const ScanFeatures>(std::move(features));
  slot.made.source = &source;
  return absl::OkStatus();
}

void ScansAhead::BeginAhead(std::size_t i) {
  if (core_.options().worker_threads < 2 || i >= scans_.size()) return;
  // A large one waits for its share, which the caller may hold.
  if (!ScanShare::IsSmall(scans_[i].scan)) return;
  ahead_ = i;
  aside_.emplace("scan ahead", [this, i] { return Make(i); });
}

absl::StatusOr<ReadyScan> ScansAhead::Take(std::size_t i) {
  const bool is_ahead = ahead_ == i;
  const absl::Status made = is_ahead ? aside_->Await() : Make(i);
  aside_.reset();
  ahead_.reset();
  ReadyScan ready = std::exchange(SlotOf(i).made, ReadyScan());
  BeginAhead(i + 1);
  if (!made.ok()) return made;
  return ready;
}

}  // namespace strata
