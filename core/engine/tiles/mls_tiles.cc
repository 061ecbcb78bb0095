#include "core/engine/tiles/mls_tiles.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Geometry>

#include "core/codec/mls_tile_codec.h"
#include "core/codec/occupancy.h"
#include "core/common/checksum.h"
#include "core/common/status.h"
#include "core/engine/map/parallel.h"
#include "core/engine/scans/scan_share.h"
#include "core/engine/scans/scan_source.h"
#include "core/mls/join.h"

namespace strata {

std::vector<TileKey> TilesOf(const MlsMap& contribution) {
  std::vector<TileKey> keys;
  for (const MlsTile& tile : contribution.tiles) {
    if (!tile.patches.empty()) keys.push_back(tile.key);
  }
  return keys;
}

std::size_t MemoryBytes(const MlsTile& tile) {
  return sizeof(tile) + tile.patches.capacity() * sizeof(Patch) +
         tile.colour.capacity() * sizeof(ColourSum) + tile.votes.capacity() * sizeof(ClassVotes);
}

Eigen::AlignedBox3d BoxOf(const MlsTile& tile, double cell_size_m) {
  Eigen::AlignedBox3d box;
  for (const Patch& patch : tile.patches) {
    const CellIndex cell = CellOf(tile.key, static_cast<std::uint16_t>(patch.cell));
    box.extend(Eigen::Vector3d(cell.x * cell_size_m, cell.y * cell_size_m, patch.bottom_m()));
    box.extend(
        Eigen::Vector3d((cell.x + 1) * cell_size_m, (cell.y + 1) * cell_size_m, patch.top_m()));
  }
  return box;
}

namespace {

// Fewer measurements have hardly a spread of their own.
constexpr std::uint64_t kMeasurementsOfSpread = 5;

void AddSpread(const Patch& patch, MlsTileRow& row) {
  if (patch.vertical() || patch.count < kMeasurementsOfSpread) return;
  const auto weight = static_cast<double>(patch.sum_w);
  const double spread_m = patch.spread_m();
  row.spread_weight += weight;
  row.spread_sum += weight * spread_m * spread_m;
}

}  // namespace

absl::StatusOr<MlsTileRow> MakeMlsTileRow(const MlsTile& tile,
                                          std::uint64_t version,
                                          double cell_size_m) {
  MlsTileRow row;
  row.key = tile.key;
  row.version = version;
  row.patches = tile.patches.size();
  for (std::size_t i = 0; i < tile.patches.size(); ++i) {
    const Patch& patch = tile.patches[i];
    if (i == 0 || patch.cell != tile.patches[i - 1].cell) ++row.cells;
    AddSpread(patch, row);
  }
  row.box = BoxOf(tile, cell_size_m);
  STRATA_ASSIGN_OR_RETURN(row.bytes, EncodeMlsTile(tile));
  ContentHasher hasher;
  hasher.Add(row.bytes);
  row.digest = hasher.HexDigest();
  return row;
}

absl::Status CheckRoomInTiles(const MlsMap& contribution, const MlsTileMap& tiles) {
  for (const MlsTile& tile : contribution.tiles) {
    const auto found = tiles.find(tile.key);
    const MlsTile* const held = found == tiles.end() ? nullptr : found->second.get();
    absl::Status fits = CheckTileSize(tile);
    if (fits.ok() && held != nullptr &&
        (tile.patches.size() + held->patches.size() > kMaxTilePatches ||
         tile.votes.size() + held->votes.size() > kMaxTileVotes)) {
      fits = CheckTileSize(JoinTiles(*held, tile, contribution.parameters));
    }
    if (fits.ok()) continue;
    return absl::OutOfRangeError(absl::StrCat(
        "no room in the map: ", fits.message(), "; take a map of larger cells or gaps"));
  }
  return absl::OkStatus();
}

void JoinContribution(const MlsMap& contribution,
                      absl::FunctionRef<bool(const TileKey&)> wanted,
                      MlsTileMap& tiles) {
  for (const MlsTile& tile : contribution.tiles) {
    if (tile.patches.empty() || !wanted(tile.key)) continue;
    MlsTilePtr& held = tiles[tile.key];
    held = held == nullptr
               ? std::make_shared<const MlsTile>(tile)
               : std::make_shared<const MlsTile>(JoinTiles(*held, tile, contribution.parameters));
  }
}

absl::StatusOr<MlsTileMap> MakeTiles(MapCore& core,
                                     const std::vector<PlacedScanRecord>& scans,
                                     const absl::btree_set<TileKey>& keys,
                                     int threads,
                                     const Stop& stop,
                                     DamagedScans* damaged,
                                     const SteadyView* view) {
  const MapParameters parameters = core.info().parameters;
  const auto wanted = [&keys](const TileKey& key) { return keys.contains(key); };
  std::vector<MlsTileMap> parts(static_cast<std::size_t>(std::max(threads, 1)));
  const absl::Status done =
      ParallelFor(threads, scans.size(), [&](int thread, std::size_t i) -> absl::Status {
        STRATA_RETURN_IF_ERROR(stop.status());
        std::optional<ReaderPool::Lease> lease;
        STRATA_ASSIGN_OR_RETURN(StorageReader * reader, ReaderOf(core, view, thread, lease));
        const ScanShare share(core.caches(), scans[i].scan);
        ScanSource source(*reader, parameters, {.change = scans[i].change});
        const absl::StatusOr<MlsMap> contribution =
            source.Contribution(scans[i].scan, scans[i].T_map_scan);
        const std::string id = scans[i].scan.header.id.ToString();
        if (damaged != nullptr &&
            damaged->LeaveOut(scans[i].scan.number, id, contribution.status())) {
          return absl::OkStatus();
        }
        if (!contribution.ok()) {
          return Annotate(contribution.status(), absl::StrCat("scan ", id));
        }
        JoinContribution(*contribution, wanted, parts[static_cast<std::size_t>(thread)]);
        return absl::OkStatus();
      });
  STRATA_RETURN_IF_ERROR(done);
  // Joins are exact and order-free: how the scans fell to the threads does not show.
  MlsTileMap tiles;
  for (const TileKey& key : keys) tiles[key] = nullptr;
  for (const MlsTileMap& part : parts) {
    for (const auto& [key, tile] : part) {
      MlsTilePtr& held = tiles[key];
      held = held == nullptr
                 ? tile
                 : std::make_shared<const MlsTile>(JoinTiles(*held, *tile, parameters.mls));
    }
  }
  return tiles;
}

absl::StatusOr<std::vector<PlacedScanRecord>> ScansOfTiles(StorageReader& reader,
                                                           const absl::btree_set<TileKey>& keys,
                                                           std::uint64_t epoch,
                                                           DamagedScans* damaged) {
  absl::btree_set<ScanNumber> numbers;
  for (const TileKey& key : keys) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<ScanNumber> scans, reader.ScansOfTile(key));
    numbers.insert(scans.begin(), scans.end());
  }
  std::vector<PlacedScanRecord> placed;
  for (const ScanNumber number : numbers) {
    absl::StatusOr<PosedScan> read = reader.GetScan(number, epoch);
    if (damaged != nullptr &&
        damaged->LeaveOut(number, absl::StrCat("row ", number), read.status())) {
      continue;
    }
    STRATA_ASSIGN_OR_RETURN(PosedScan posed, std::move(read));
    if (!posed.pose.has_value()) continue;
    placed.push_back({std::move(posed.scan), posed.pose->T_map_scan});
  }
  return placed;
}

absl::StatusOr<MlsTilePtr> MlsTileStore::Load(StorageReader& reader,
                                              const TileKey& key,
                                              std::uint64_t version) {
  if (MlsTilePtr held = cache_.Find(key); held != nullptr) return held;
  STRATA_ASSIGN_OR_RETURN(const std::optional<MlsTileRow> row, reader.FindMlsTile(key, version));
  if (!row.has_value()) return MlsTilePtr();
  absl::StatusOr<MlsTile> decoded = DecodeMlsTile(row->bytes);
  MlsTilePtr tile;
  if (decoded.ok() && decoded->key == key) {
    tile = std::make_shared<const MlsTile>(*std::move(decoded));
  } else {
    const std::uint64_t epoch = core_.snapshots().current().epoch;
    STRATA_ASSIGN_OR_RETURN(const std::vector<PlacedScanRecord> scans,
                            ScansOfTiles(reader, {key}, epoch));
    STRATA_ASSIGN_OR_RETURN(const MlsTileMap made, MakeTiles(core_, scans, {key}, 1, Stop()));
    tile = made.at(key);
    if (tile == nullptr) return tile;
  }
  cache_.Put(key, tile, MemoryBytes(*tile));
  return tile;
}

void MlsTileStore::Replace(const MlsTileMap& tiles) {
  for (const auto& [key, tile] : tiles) {
    if (tile == nullptr) {
      cache_.Erase(key);
    } else {
      cache_.Put(key, tile, MemoryBytes(*tile));
    }
  }
}

}  // namespace strata
