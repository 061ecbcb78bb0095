#include "core/engine/scans/scan_access.h"

#include <memory>
#include <utility>

#include "core/common/status.h"
#include "core/common/stop.h"

namespace strata {

absl::StatusOr<MapState::Loan> ScanAccess::Reader() const {
  if (core_ != nullptr) {
    STRATA_ASSIGN_OR_RETURN(ReaderPool::Lease lease, core_->Reader());
    return MapState::Loan(std::move(lease));
  }
  STRATA_ASSIGN_OR_RETURN(std::unique_ptr<StorageReader> reader, store_->NewReader());
  return MapState::Loan(std::move(reader));
}

absl::StatusOr<MapView> ScanAccess::View() const {
  if (core_ != nullptr) return core_->snapshots().current();
  STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, Reader());
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader->GetClock());
  return MapView{clock.epoch, clock.tile_version};
}

void ScanAccess::Keep(ScanNumber number, const ScanView& view) const {
  if (core_ == nullptr) return;
  core_->writer()
      .Run(Durability::kRelaxed,
           view.place.size() + view.planes.size(),
           Stop(),
           [&](StorageWriter& writer) { return writer.PutScanView(number, view); })
      .IgnoreError();
}

}  // namespace strata
