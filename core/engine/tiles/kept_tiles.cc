#include "core/engine/tiles/kept_tiles.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/codec/bytes.h"
#include "core/common/checksum.h"
#include "core/planning/tile_cache.h"

namespace strata {
namespace {

std::uint64_t ChecksumOf(const TileKey& key, absl::string_view made_of, absl::string_view packed) {
  std::string all;
  PutFixed(all, key.x);
  PutFixed(all, key.y);
  absl::StrAppend(&all, made_of, packed);
  return Checksum64(all);
}

}  // namespace

TileVersionMap VersionsOfTiles(const std::vector<SurfaceTileRow>& rows) {
  TileVersionMap versions;
  versions.reserve(rows.size());
  for (const SurfaceTileRow& row : rows) versions[row.key] = row.version;
  return versions;
}

TileVersions VersionsAround(const TileVersionMap& versions, const TileKey& key) {
  TileVersions around{};
  for (int i = 0; i < 9; ++i) {
    const auto it = versions.find(Neighbour(key, i));
    if (it != versions.end()) around[static_cast<std::size_t>(i)] = it->second;
  }
  return around;
}

std::string MadeOf(const TileVersions& versions, const RobotProfile& profile) {
  std::string made_of;
  PutFixed(made_of, kPreparationForm);
  for (const std::uint64_t version : versions) PutFixed(made_of, version);
  for (const double value : {profile.radius_m,
                             profile.height_m,
                             profile.max_step_m,
                             profile.max_slope_rad,
                             profile.max_gap_m,
                             profile.max_roughness_m}) {
    PutFixed(made_of, std::bit_cast<std::uint64_t>(value));
  }
  return made_of;
}

PreparedTileRow SealTile(const TileKey& key, std::string made_of, std::string packed) {
  PutFixed(packed, ChecksumOf(key, made_of, packed));
  return {key, std::move(made_of), std::move(packed)};
}

absl::StatusOr<std::string> UnsealTile(const TileKey& key,
                                       absl::string_view made_of,
                                       std::string bytes) {
  if (bytes.size() > sizeof(std::uint64_t)) {
    const std::size_t size = bytes.size() - sizeof(std::uint64_t);
    const auto checksum = ByteReader(absl::string_view(bytes).substr(size)).Fixed<std::uint64_t>();
    bytes.resize(size);
    if (checksum == ChecksumOf(key, made_of, bytes)) return bytes;
  }
  return absl::DataLossError(
      absl::StrCat("tile ", key.ToString(), " as it was prepared is damaged; it is prepared anew"));
}

bool IsCurrent(const PreparedTileRow& row,
               const TileVersionMap& versions,
               const RobotProfile& profile) {
  return versions.contains(row.key) &&
         row.made_of == MadeOf(VersionsAround(versions, row.key), profile);
}

std::vector<TileKey> StaleTiles(const TileVersionMap& versions,
                                const std::vector<PreparedTileRow>& rows,
                                const RobotProfile& profile) {
  absl::btree_set<TileKey> stale;
  for (const auto& [key, version] : versions) stale.insert(key);
  for (const PreparedTileRow& row : rows) {
    if (IsCurrent(row, versions, profile)) {
      stale.erase(row.key);
    } else {
      stale.insert(row.key);
    }
  }
  return {stale.begin(), stale.end()};
}

}  // namespace strata
