// Tiles to code: made up with seeds, and of recorded scans.
#ifndef STRATA_TESTS_CORE_CODEC_TILE_SAMPLES_H_
#define STRATA_TESTS_CORE_CODEC_TILE_SAMPLES_H_

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/cloud/point_cloud.h"
#include "core/mls/mls_map.h"

namespace strata::testing {

// Tile (0, 0) with about `patches` patches of all kinds, from single measurements to full ones.
MlsTile RandomTile(std::uint64_t seed, int patches, bool with_layers);

// The points of a PCD file with three float fields and binary data (as the NCLT scans are).
std::vector<Eigen::Vector3f> ReadPlainPcd(const std::filesystem::path& file);

// The map of all NCLT scans whose index is a multiple of `stride`, at reference poses, 10 cm cells;
// built in the plainest way: all measurements sorted, joined one by one.
MlsMap NcltMap(const std::filesystem::path& folder, int stride);

// The points of all NCLT scans at reference poses.
std::vector<Eigen::Vector3d> NcltPointsInMap(const std::filesystem::path& folder);

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_CODEC_TILE_SAMPLES_H_
