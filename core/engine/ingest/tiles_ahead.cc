#include "core/engine/ingest/tiles_ahead.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/engine/map/parallel.h"
#include "core/engine/tiles/surface_tiles.h"

namespace strata {
namespace {

constexpr std::size_t kMostBytes = std::size_t{64} << 20;

bool IsSame(const Pose& a, const Pose& b) { return a.matrix() == b.matrix(); }

}  // namespace

absl::Status TilesAhead::Make(const std::vector<ProposedPose>& moves,
                              int threads,
                              const Stop& stop) {
  const std::uint64_t epoch = core_.snapshots().current().epoch;
  std::vector<ChangedScan> moved(moves.size());
  STRATA_RETURN_IF_ERROR(
      ParallelFor(threads, moves.size(), [&](int, std::size_t i) -> absl::Status {
        STRATA_RETURN_IF_ERROR(stop.status());
        STRATA_ASSIGN_OR_RETURN(moved[i], MovedScan(core_, moves[i], epoch, nullptr));
        return absl::OkStatus();
      }));
  for (ChangedScan& scan : moved) {
    const ScanNumber number = scan.scan.number;
    moved_[number] = std::move(scan);
  }
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
  return MakeBlocks(*reader, epoch, threads, stop);
}

absl::Status TilesAhead::MakeBlocks(StorageReader& reader,
                                    std::uint64_t epoch,
                                    int threads,
                                    const Stop& stop) {
  const double cell_size_m = core_.info().parameters.mls.cell_size_m;
  STRATA_ASSIGN_OR_RETURN(const KeySet keys, TilesToChange(reader, moved_));
  std::size_t bytes = 0;
  for (const KeySet& block : TileBlocks(keys)) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<PlacedScanRecord> scans,
                            ScansToBe(reader, block, moved_, epoch, nullptr));
    STRATA_ASSIGN_OR_RETURN(const MlsTileMap tiles, MakeTiles(core_, scans, block, threads, stop));
    Block made;
    for (const PlacedScanRecord& placed : scans) {
      made.scans[placed.scan.number] = placed.T_map_scan;
    }
    for (const auto& [key, tile] : tiles) {
      std::optional<MlsTileRow>& row = made.rows[key];
      if (tile == nullptr) continue;
      STRATA_ASSIGN_OR_RETURN(row, MakeMlsTileRow(*tile, 0, cell_size_m));
      bytes += row->bytes.size();
    }
    if (bytes > kMostBytes) return absl::OkStatus();
    blocks_.push_back(std::move(made));
  }
  return absl::OkStatus();
}

const ChangedScan* TilesAhead::FindScan(ScanNumber number, const Pose& T_map_scan) const {
  const auto found = moved_.find(number);
  if (found == moved_.end() || !IsSame(found->second.T_map_scan, T_map_scan)) return nullptr;
  return &found->second;
}

const TilesAhead::Block* TilesAhead::Find(const KeySet& keys,
                                          const std::vector<PlacedScanRecord>& scans) const {
  const auto lies_in = [&keys](const Block& block) {
    return std::any_of(block.rows.begin(), block.rows.end(), [&keys](const auto& row) {
      return keys.contains(row.first);
    });
  };
  const auto block = std::find_if(blocks_.begin(), blocks_.end(), lies_in);
  if (block == blocks_.end()) return nullptr;
  std::size_t same = 0;
  for (const PlacedScanRecord& placed : scans) {
    const auto found = block->scans.find(placed.scan.number);
    if (found == block->scans.end()) continue;
    if (!IsSame(found->second, placed.T_map_scan)) return nullptr;
    ++same;
  }
  return same == block->scans.size() ? &*block : nullptr;
}

}  // namespace strata
