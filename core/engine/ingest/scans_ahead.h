// Scans that wait for integration, one after the other, each ready to be placed: what is made of a
// scan alone is made of the next one while the caller works on the current one.
#ifndef STRATA_CORE_ENGINE_INGEST_SCANS_AHEAD_H_
#define STRATA_CORE_ENGINE_INGEST_SCANS_AHEAD_H_

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/engine/map/aside.h"
#include "core/engine/map/map_core.h"
#include "core/engine/scans/scan_source.h"
#include "core/registration/scan_features.h"
#include "core/storage/storage.h"
#include "core/world/map_info.h"

namespace strata {

// What is a function of the scan, what is said of its points, and the map's parameters.
struct ReadyScan {
  std::shared_ptr<const ScanFeatures> features;  // with a sample
  std::string local_map;                         // encoded; only if the points go
  ScanSource* source = nullptr;                  // of its points, until the next scan is taken
};

// One thread at a time. Nothing of a scan is kept beyond the one after it, and none but a small one
// is made before its turn.
class ScansAhead {
 public:
  // Both must outlive this; nothing of the scans may change meanwhile.
  ScansAhead(MapCore& core, std::span<const PosedScan> scans);

  // Scan `i`, in ascending order, each once, or the error that it causes. Then begins the one after
  // it.
  absl::StatusOr<ReadyScan> Take(std::size_t i);

 private:
  struct Slot {
    std::optional<ReaderPool::Lease> reader;
    std::optional<ScanSource> source;
    ReadyScan made;
  };

  Slot& SlotOf(std::size_t i) { return slots_[i % slots_.size()]; }
  absl::Status Make(std::size_t i);
  void BeginAhead(std::size_t i);

  MapCore& core_;
  const std::span<const PosedScan> scans_;
  const MapParameters parameters_;
  std::array<Slot, 2> slots_;  // the caller's, and the one ahead
  std::optional<std::size_t> ahead_;
  std::optional<Aside> aside_;  // makes it; ends before what it works on
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_SCANS_AHEAD_H_
