// Scans that are given labels: their votes change, their geometry stays.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/ingest/integrator.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/scan_source.h"
#include "core/mls/revote.h"

namespace strata {
namespace {

absl::Status CheckLabels(const ScanRecord& scan, std::size_t labels) {
  const std::string what = absl::StrCat("scan ", scan.header.id.ToString());
  if (!scan.has_points) {
    return absl::FailedPreconditionError(absl::StrCat(
        what, ": the map dropped its points; label scans before they are integrated, or upload"));
  }
  if (labels == scan.header.point_count) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      what, ": ", labels, " labels for ", scan.header.point_count, " points; give one for each"));
}

}  // namespace

absl::StatusOr<MlsTileMap> Integrator::Revoted(StorageReader& reader,
                                               const PosedScan& posed,
                                               const LabelChange& change) {
  const MapParameters parameters = core_.info().parameters;
  const Pose& T_map_scan = posed.pose->T_map_scan;
  // Labels may be damaged; new ones mend them.
  const absl::StatusOr<MlsMap> before =
      ScanSource(reader, parameters).Contribution(posed.scan, T_map_scan);
  if (!before.ok() && !absl::IsDataLoss(before.status())) return before.status();
  STRATA_ASSIGN_OR_RETURN(
      const MlsMap after,
      ScanSource(reader, parameters, {.change = &change}).Contribution(posed.scan, T_map_scan));
  const std::uint64_t version = core_.snapshots().current().tile_version;
  MlsTileMap tiles;
  for (const MlsTile& tile : after.tiles) {
    if (tile.patches.empty()) continue;
    const MlsTile* const old = before.ok() ? before->Find(tile.key) : nullptr;
    if (old != nullptr && old->votes == tile.votes) continue;
    STRATA_ASSIGN_OR_RETURN(const MlsTilePtr held, store_.Load(reader, tile.key, version));
    std::optional<MlsTile> changed;
    if (held != nullptr && old != nullptr) changed = ReplaceVotes(*held, *old, tile);
    if (changed.has_value()) {
      tiles[tile.key] = std::make_shared<const MlsTile>(*std::move(changed));
      continue;
    }
    // Damage, or votes beyond counting: from all its scans, then.
    STRATA_ASSIGN_OR_RETURN(MlsTileMap others, TilesWithout(reader, {tile.key}, posed.scan.number));
    JoinContribution(
        after, [&tile](const TileKey& key) { return key == tile.key; }, others);
    tiles.insert(others.begin(), others.end());
  }
  return tiles;
}

absl::Status Integrator::ChangeLabels(StorageReader& reader,
                                      const PosedScan& posed,
                                      const LabelChange& change,
                                      Decision also) {
  const absl::Cleanup edited = [this] { core_.NoteEdit(); };
  STRATA_RETURN_IF_ERROR(CheckLabels(posed.scan, change.labels.size()));
  const std::vector<std::string> pieces = EncodeLabelChange(change);
  const auto put = [&](StorageWriter& writer) -> absl::Status {
    STRATA_RETURN_IF_ERROR(
        writer.PutLabels(posed.scan.number, change.origin, change.model, pieces));
    return also(writer);
  };
  TileChange tiles;
  if (posed.scan.state == ScanState::kIntegrated && posed.pose.has_value()) {
    STRATA_ASSIGN_OR_RETURN(tiles.tiles, Revoted(reader, posed, change));
  }
  if (tiles.tiles.empty()) return core_.writer().Run(Durability::kFull, 0, Stop(), put);
  STRATA_ASSIGN_OR_RETURN(tiles.version, NextVersion());
  STRATA_RETURN_IF_ERROR(
      MakeServed(reader, tiles, core_.options().worker_threads, /*geometry=*/false));
  return Commit(tiles, {}, put);
}

absl::Status Integrator::SetPersonLabels(const ScanId& id,
                                         const std::vector<std::uint16_t>& labels,
                                         bool update,
                                         Decision also) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, GetScanById(*reader, id, epoch()));
  STRATA_RETURN_IF_ERROR(CheckLabels(posed.scan, labels.size()));
  LabelChange change;
  change.labels = labels;
  if (update && posed.scan.person_labels) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> said,
                            ReadLabels(*reader, posed.scan, LabelOrigin::kPerson));
    for (std::size_t i = 0; i < said.size(); ++i) {
      if (change.labels[i] == 0) change.labels[i] = said[i];
    }
  }
  return ChangeLabels(*reader, posed, change, also);
}

absl::Status Integrator::SetModelLabels(ScanNumber number,
                                        std::uint64_t model,
                                        std::vector<std::uint16_t> labels) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  STRATA_ASSIGN_OR_RETURN(const PosedScan posed, reader->GetScan(number, epoch()));
  return ChangeLabels(*reader, posed, {LabelOrigin::kModel, model, std::move(labels)}, Nothing);
}

}  // namespace strata
