// Scans of which points fade, or come back.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/container/btree_map.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/ingest/changed_tiles.h"
#include "core/engine/ingest/integrator.h"
#include "core/engine/map/parallel.h"
#include "core/engine/scans/scan_source.h"
#include "core/engine/tiles/staged_tiles.h"

namespace strata {
namespace {

// What is stored of a scan that changes.
struct FadedLabels {
  std::uint64_t points = 0;
  std::vector<std::string> pieces;
};
// A scan as it will be, and what is stored of it.
using Change = std::pair<ChangedScan, FadedLabels>;

double Share(std::size_t i, std::size_t count) {
  return static_cast<double>(i) / static_cast<double>(count);
}

// Makes the tiles of scans that change beside the current ones, then switches readers. `store` must
// be empty, and holds tiles as they will be afterwards.
class FadingPass {
 public:
  FadingPass(MapCore& core,
             MlsTileStore& store,
             const FadingRequest& request,
             std::uint64_t version,
             JobContext& context)
      : core_(core),
        store_(store),
        request_(request),
        context_(context),
        threads_(core.options().worker_threads),
        epoch_(core.snapshots().current().epoch),
        version_(version),
        staged_(core, version) {}

  absl::StatusOr<std::size_t> Run() {
    STRATA_RETURN_IF_ERROR(FindChanges());
    if (changed_.empty()) return 0;
    {
      STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
      ChangedTiles tiles(core_,
                         store_,
                         staged_,
                         changed_,
                         {.version = version_,
                          .threads = threads_,
                          .joining = 0.8,
                          .annotating = 0.9,
                          .change_of = request_.change_of},
                         context_);
      STRATA_RETURN_IF_ERROR(tiles.Stage(*reader).status());
    }
    STRATA_RETURN_IF_ERROR(Publish());
    return changed_.size();
  }

 private:
  absl::Status FindChanges() {
    const std::vector<ScanNumber>& scans = request_.scans;
    std::vector<std::optional<Change>> found(scans.size());
    STRATA_RETURN_IF_ERROR(
        ParallelFor(threads_, scans.size(), [&](int thread, std::size_t i) -> absl::Status {
          STRATA_RETURN_IF_ERROR(context_.stop().status());
          if (thread == 0) {
            STRATA_RETURN_IF_ERROR(
                context_.Progress(0.7 + 0.1 * Share(i, scans.size()), "finding what changes"));
          }
          STRATA_ASSIGN_OR_RETURN(found[i], FindChange(scans[i]));
          return absl::OkStatus();
        }));
    for (std::optional<Change>& change : found) {
      if (!change.has_value()) continue;
      const ScanNumber number = change->first.scan.number;
      changed_[number] = std::move(change->first);
      labels_[number] = std::move(change->second);
    }
    return absl::OkStatus();
  }

  // nullopt: as it is stored, or gone.
  absl::StatusOr<std::optional<Change>> FindChange(ScanNumber number) const {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    absl::StatusOr<PosedScan> posed = reader->GetScan(number, epoch_);
    if (absl::IsNotFound(posed.status())) return std::nullopt;
    STRATA_RETURN_IF_ERROR(posed.status());
    if (posed->scan.state != ScanState::kIntegrated || !posed->pose.has_value()) {
      return std::nullopt;
    }
    const LabelChange change = request_.change_of(posed->scan);
    STRATA_ASSIGN_OR_RETURN(const bool stored, IsStored(*reader, posed->scan, change));
    if (stored) return std::nullopt;
    ChangedScan scan;
    scan.scan = std::move(posed->scan);
    scan.T_map_scan = posed->pose->T_map_scan;
    const MapParameters parameters = core_.info().parameters;
    ScanSource source(*reader, parameters, {.change = &change});
    const absl::StatusOr<MlsMap> contribution = source.Contribution(scan.scan, scan.T_map_scan);
    if (!contribution.ok()) {
      return Annotate(contribution.status(), absl::StrCat("scan ", scan.scan.header.id.ToString()));
    }
    scan.tiles = TilesOf(*contribution);
    return Change{std::move(scan), {change.model, EncodeLabelChange(change)}};
  }

  static absl::StatusOr<bool> IsStored(StorageReader& reader,
                                       const ScanRecord& scan,
                                       const LabelChange& change) {
    if (scan.faded_points == 0 || change.model == 0) return scan.faded_points == change.model;
    STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> stored,
                            ReadLabels(reader, scan, LabelOrigin::kFaded));
    return stored == change.labels;
  }

  absl::Status Publish() {
    std::vector<ScanId> ids;
    for (const auto& [number, scan] : changed_) ids.push_back(scan.scan.header.id);
    return staged_.Publish(ids, [this](StorageWriter& writer) -> absl::Status {
      for (const auto& [number, labels] : labels_) {
        STRATA_RETURN_IF_ERROR(
            writer.PutLabels(number, LabelOrigin::kFaded, labels.points, labels.pieces));
        STRATA_RETURN_IF_ERROR(writer.SetTilesOfScan(number, changed_.at(number).tiles));
      }
      return absl::OkStatus();
    });
  }

  MapCore& core_;
  MlsTileStore& store_;
  const FadingRequest& request_;
  JobContext& context_;
  const int threads_;
  const std::uint64_t epoch_;
  const std::uint64_t version_;
  StagedTiles staged_;
  ChangedScans changed_;
  absl::btree_map<ScanNumber, FadedLabels> labels_;
};

}  // namespace

absl::StatusOr<std::size_t> Integrator::SetFaded(const FadingRequest& request,
                                                 JobContext& context) {
  const absl::Cleanup edited = [this] { core_.NoteEdit(); };
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t version, NextVersion());
  // Decoded tiles are kept by key alone: those to come must not outlive a failure.
  store_.Clear();
  absl::StatusOr<std::size_t> changed = FadingPass(core_, store_, request, version, context).Run();
  ForgetCaches();
  return changed;
}

}  // namespace strata
