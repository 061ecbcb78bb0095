// Bytes and time of tiles and points, on all NCLT scans at reference poses and 10 cm cells,
// annotated for the default robot, beside what a plain program would write (row structs through
// zstd 3) and OctoMap's .bt of the same points. The thesis' maps take 85 bytes an occupied cell
// (6.6).
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <octomap/OcTree.h>
#include <zstd.h>

#include "core/codec/mls_tile_codec.h"
#include "core/codec/point_codec.h"
#include "core/codec/surface_tile_codec.h"
#include "core/mls/traversability.h"
#include "tests/core/codec/tile_samples.h"
#include "tests/support/data_dir.h"

namespace strata {
namespace {

struct World {
  MlsMap map;
  std::vector<SurfaceTile> surfaces;
  std::vector<PointCloud> chunks;
  std::size_t point_count = 0;
};

void Annotate(const MlsMap& map, std::vector<SurfaceTile>& tiles) {
  const auto find = [&tiles, &map](const TileKey& key) -> const SurfaceTile* {
    const MlsTile* const found = map.Find(key);
    return found == nullptr ? nullptr : &tiles[static_cast<std::size_t>(found - map.tiles.data())];
  };
  for (SurfaceTile& tile : tiles) {
    SurfaceNeighbourhood around{};
    for (int i = 0; i < 9; ++i) {
      if (i == 4) continue;
      around[i] = find({tile.key.level, tile.key.x + i % 3 - 1, tile.key.y + i / 3 - 1});
    }
    AnnotateTraversability(tile, around, map.parameters.cell_size_m, {});
  }
}

World MakeWorld(const std::filesystem::path& folder) {
  World world{.map = testing::NcltMap(folder, 1), .surfaces = {}, .chunks = {}};
  for (const MlsTile& tile : world.map.tiles) world.surfaces.push_back(SurfacesOf(tile));
  Annotate(world.map, world.surfaces);
  for (const auto& entry : std::filesystem::directory_iterator(folder / "scans")) {
    PointCloud& chunk = world.chunks.emplace_back();
    chunk.points = testing::ReadPlainPcd(entry.path());
    chunk.points.resize(std::min(chunk.points.size(), kMaxEncodedPoints));
    world.point_count += chunk.size();
  }
  return world;
}

const World& TheWorld() {
  static const World world = [] {
    const auto folder = testing::FindData("nclt_campus_loop");
    if (!folder.has_value()) {
      std::fprintf(stderr, "no recorded data: set STRATA_DATA\n");
      std::exit(1);
    }
    return MakeWorld(*folder);
  }();
  return world;
}

template <typename Tile>
std::string RowsThroughZstd(const std::vector<Tile>& rows) {
  std::string packed(ZSTD_compressBound(rows.size() * sizeof(Tile)), '\0');
  packed.resize(
      ZSTD_compress(packed.data(), packed.size(), rows.data(), rows.size() * sizeof(Tile), 3));
  return packed;
}

// Encodes all items once an iteration; reports time and bytes.
template <typename Items, typename Encode>
void RunEncode(benchmark::State& state, const Items& items, Encode encode) {
  std::size_t bytes = 0;
  for (auto _ : state) {
    bytes = 0;
    for (const auto& item : items) bytes += encode(item).size();
  }
  const World& world = TheWorld();
  const auto total = static_cast<double>(bytes);
  state.counters["per_item"] = benchmark::Counter(
      static_cast<double>(items.size()),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["bytes_per_patch"] = total / static_cast<double>(world.map.patch_count());
  state.counters["bytes_per_cell"] = total / static_cast<double>(world.map.occupied_cell_count());
  state.counters["bytes_per_point"] = total / static_cast<double>(world.point_count);
}

template <typename Items, typename Encode, typename Decode>
void RunDecode(benchmark::State& state, const Items& items, Encode encode, Decode decode) {
  std::vector<std::string> blobs;
  for (const auto& item : items) blobs.push_back(encode(item));
  for (auto _ : state) {
    for (const std::string& blob : blobs) {
      auto decoded = decode(blob);
      benchmark::DoNotOptimize(decoded);
    }
  }
  state.counters["per_item"] = benchmark::Counter(
      static_cast<double>(items.size()),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

std::string EncodedSurfaces(const SurfaceTile& tile) { return EncodeSurfaceTile(tile).value(); }
std::string EncodedTile(const MlsTile& tile) { return EncodeMlsTile(tile).value(); }

void SurfaceTileEncode(benchmark::State& state) {
  RunEncode(state, TheWorld().surfaces, &EncodedSurfaces);
}
void SurfaceTileDecode(benchmark::State& state) {
  RunDecode(state, TheWorld().surfaces, &EncodedSurfaces, &DecodeSurfaceTile);
}
void SurfaceRowsThroughZstd(benchmark::State& state) {
  RunEncode(state, TheWorld().surfaces, [](const SurfaceTile& tile) {
    return RowsThroughZstd(tile.surfaces);
  });
}
void MlsTileEncode(benchmark::State& state) {
  RunEncode(state, TheWorld().map.tiles, &EncodedTile);
}
void MlsTileDecode(benchmark::State& state) {
  RunDecode(state, TheWorld().map.tiles, &EncodedTile, &DecodeMlsTile);
}
void MlsRowsThroughZstd(benchmark::State& state) {
  RunEncode(state, TheWorld().map.tiles, [](const MlsTile& tile) {
    return RowsThroughZstd(tile.patches);
  });
}
std::string EncodedPoints(const PointCloud& chunk) { return EncodePoints(chunk).value(); }

void PointsEncode(benchmark::State& state) {
  RunEncode(state, TheWorld().chunks, &EncodedPoints);
  state.SetBytesProcessed(
      static_cast<std::int64_t>(state.iterations() * TheWorld().point_count * 12));
}
void PointsDecode(benchmark::State& state) {
  RunDecode(state, TheWorld().chunks, &EncodedPoints, &DecodePoints);
  state.SetBytesProcessed(
      static_cast<std::int64_t>(state.iterations() * TheWorld().point_count * 12));
}
void PointRowsThroughZstd(benchmark::State& state) {
  RunEncode(state, TheWorld().chunks, [](const PointCloud& chunk) {
    return RowsThroughZstd(chunk.points);
  });
  state.SetBytesProcessed(
      static_cast<std::int64_t>(state.iterations() * TheWorld().point_count * 12));
}

// End points only, pruned, occupied or not: .bt as OctoMap writes it.
void OctoMapBt(benchmark::State& state) {
  const std::vector<Eigen::Vector3d> points =
      testing::NcltPointsInMap(*testing::FindData("nclt_campus_loop"));
  std::string bytes;
  for (auto _ : state) {
    octomap::OcTree tree(TheWorld().map.parameters.cell_size_m);
    for (const Eigen::Vector3d& p : points) {
      tree.updateNode(
          octomap::point3d(
              static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())),
          true,
          true);
    }
    tree.updateInnerOccupancy();
    tree.prune();
    std::ostringstream out;
    tree.writeBinary(out);
    bytes = out.str();
  }
  const auto total = static_cast<double>(bytes.size());
  state.counters["bytes_per_patch"] = total / static_cast<double>(TheWorld().map.patch_count());
  state.counters["bytes_per_cell"] =
      total / static_cast<double>(TheWorld().map.occupied_cell_count());
}

BENCHMARK(SurfaceTileEncode)->Unit(benchmark::kMillisecond);
BENCHMARK(SurfaceTileDecode)->Unit(benchmark::kMillisecond);
BENCHMARK(SurfaceRowsThroughZstd)->Unit(benchmark::kMillisecond);
BENCHMARK(MlsTileEncode)->Unit(benchmark::kMillisecond);
BENCHMARK(MlsTileDecode)->Unit(benchmark::kMillisecond);
BENCHMARK(MlsRowsThroughZstd)->Unit(benchmark::kMillisecond);
BENCHMARK(PointsEncode)->Unit(benchmark::kMillisecond);
BENCHMARK(PointsDecode)->Unit(benchmark::kMillisecond);
BENCHMARK(PointRowsThroughZstd)->Unit(benchmark::kMillisecond);
BENCHMARK(OctoMapBt)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
}  // namespace strata

BENCHMARK_MAIN();
