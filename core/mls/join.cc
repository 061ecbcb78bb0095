#include "core/mls/join.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

bool Before(const Patch& a, const Patch& b) {
  return a.cell != b.cell ? a.cell < b.cell : a.z_min < b.z_min;
}

// Appends `patch`, the next in order of (cell, z_min), to the patches joined so far.
void Append(std::vector<Patch>& joined, const Patch& patch, const MlsParameters& parameters) {
  if (!joined.empty() && joined.back().cell == patch.cell &&
      Touching(joined.back(), patch, parameters)) {
    JoinInto(joined.back(), patch, parameters);
  } else {
    joined.push_back(patch);
  }
}

std::uint32_t SaturatingSum(std::uint32_t a, std::uint32_t b) {
  return a > std::numeric_limits<std::uint32_t>::max() - b
             ? std::numeric_limits<std::uint32_t>::max()
             : a + b;
}

// Where the layers of the joined tile come from: for each patch of a source its joined patch.
using Destination = std::vector<std::uint32_t>;

void AddColour(const MlsTile& from, const Destination& to, std::vector<ColourSum>& colour) {
  for (std::size_t i = 0; i < from.colour.size(); ++i) {
    ColourSum& sum = colour[to[i]];
    sum.r += from.colour[i].r;
    sum.g += from.colour[i].g;
    sum.b += from.colour[i].b;
    sum.count += from.colour[i].count;
  }
}

void AddVotes(const MlsTile& from, const Destination& to, std::vector<ClassVotes>& votes) {
  for (const ClassVotes& vote : from.votes) {
    votes.push_back({to[vote.patch], vote.class_id, vote.count});
  }
}

// Sorts by (patch, class) and adds up equal ones.
void Canonicalise(std::vector<ClassVotes>& votes) {
  std::sort(votes.begin(), votes.end(), [](const ClassVotes& a, const ClassVotes& b) {
    return std::tie(a.patch, a.class_id) < std::tie(b.patch, b.class_id);
  });
  std::size_t kept = 0;
  for (const ClassVotes& vote : votes) {
    const bool same = kept > 0 && votes[kept - 1].patch == vote.patch &&
                      votes[kept - 1].class_id == vote.class_id;
    if (same) {
      votes[kept - 1].count = SaturatingSum(votes[kept - 1].count, vote.count);
    } else {
      votes[kept++] = vote;
    }
  }
  votes.resize(kept);
  votes.shrink_to_fit();
}

bool HasLayers(const MlsTile& tile) { return !tile.colour.empty() || !tile.votes.empty(); }

// Merges the patches of two tiles; `to_a`, `to_b` receive destinations unless null.
std::vector<Patch> MergePatches(const MlsTile& a,
                                const MlsTile& b,
                                const MlsParameters& parameters,
                                Destination* to_a,
                                Destination* to_b) {
  std::vector<Patch> joined;
  joined.reserve(a.patches.size() + b.patches.size());
  auto next_a = a.patches.begin();
  auto next_b = b.patches.begin();
  while (next_a != a.patches.end() || next_b != b.patches.end()) {
    const bool take_a =
        next_b == b.patches.end() || (next_a != a.patches.end() && Before(*next_a, *next_b));
    Append(joined, take_a ? *next_a++ : *next_b++, parameters);
    Destination* const to = take_a ? to_a : to_b;
    if (to != nullptr) to->push_back(static_cast<std::uint32_t>(joined.size() - 1));
  }
  joined.shrink_to_fit();
  return joined;
}

// One patch on its way from a local map into the map.
struct MovedPatch {
  TileKey tile;
  Patch patch;
  std::uint32_t source_tile;
  std::uint32_t source_patch;
};

std::vector<MovedPatch> MovePatches(const MlsMap& local_map, const Pose& T_map_scan) {
  const double cell_size = local_map.parameters.cell_size_m;
  std::vector<MovedPatch> moved;
  moved.reserve(local_map.patch_count());
  for (std::uint32_t t = 0; t < local_map.tiles.size(); ++t) {
    const MlsTile& tile = local_map.tiles[t];
    for (std::uint32_t i = 0; i < tile.patches.size(); ++i) {
      MovedPatch m{.tile = {}, .patch = tile.patches[i], .source_tile = t, .source_patch = i};
      const CellIndex from = CellOf(tile.key, static_cast<std::uint16_t>(m.patch.cell));
      const Eigen::Vector3d p_scan(
          (from.x + 0.5) * cell_size, (from.y + 0.5) * cell_size, m.patch.mean_m());
      const Eigen::Vector3d p_map = T_map_scan * p_scan;
      const double x = std::floor(p_map.x() / cell_size);
      const double y = std::floor(p_map.y() / cell_size);
      const double rise = std::nearbyint((p_map.z() - p_scan.z()) * kTicksPerMetre);
      if (!(std::max(std::abs(x + 0.5), std::abs(y + 0.5)) < kMaxCellIndex) ||
          !(m.patch.z_min + rise >= -kMaxZTicks) || !(m.patch.z_max + rise <= kMaxZTicks)) {
        continue;
      }
      const CellIndex to{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)};
      m.tile = TileOfCell(to);
      m.patch.cell = CellInTile(to);
      m.patch.z_min += static_cast<std::int32_t>(rise);
      m.patch.z_max += static_cast<std::int32_t>(rise);
      moved.push_back(m);
    }
  }
  std::sort(moved.begin(), moved.end(), [](const MovedPatch& a, const MovedPatch& b) {
    if (a.tile != b.tile) return a.tile < b.tile;
    if (a.patch.cell != b.patch.cell || a.patch.z_min != b.patch.z_min) {
      return Before(a.patch, b.patch);
    }
    return std::tie(a.source_tile, a.source_patch) < std::tie(b.source_tile, b.source_patch);
  });
  return moved;
}

// The tile of the moved patches of one tile, layers included.
MlsTile TileOfMoved(std::span<const MovedPatch> moved, const MlsMap& local_map) {
  MlsTile tile;
  tile.key = moved.front().tile;
  for (const MovedPatch& m : moved) {
    Append(tile.patches, m.patch, local_map.parameters);
    const auto patch = static_cast<std::uint32_t>(tile.patches.size() - 1);
    const MlsTile& source = local_map.tiles[m.source_tile];
    if (!source.colour.empty()) {
      tile.colour.resize(tile.patches.size());
      const ColourSum& colour = source.colour[m.source_patch];
      ColourSum& sum = tile.colour[patch];
      sum.r += colour.r;
      sum.g += colour.g;
      sum.b += colour.b;
      sum.count += colour.count;
    }
    auto vote = std::lower_bound(source.votes.begin(),
                                 source.votes.end(),
                                 m.source_patch,
                                 [](const ClassVotes& v, std::uint32_t p) { return v.patch < p; });
    for (; vote != source.votes.end() && vote->patch == m.source_patch; ++vote) {
      tile.votes.push_back({patch, vote->class_id, vote->count});
    }
  }
  if (!tile.colour.empty()) tile.colour.resize(tile.patches.size());
  tile.patches.shrink_to_fit();
  tile.colour.shrink_to_fit();
  Canonicalise(tile.votes);
  tile.IndexRows();
  return tile;
}

}  // namespace

MlsTile JoinTiles(const MlsTile& a, const MlsTile& b, const MlsParameters& parameters) {
  MlsTile joined;
  joined.key = a.key;
  if (!HasLayers(a) && !HasLayers(b)) {
    joined.patches = MergePatches(a, b, parameters, nullptr, nullptr);
    joined.IndexRows();
    return joined;
  }
  Destination to_a;
  Destination to_b;
  joined.patches = MergePatches(a, b, parameters, &to_a, &to_b);
  joined.IndexRows();
  if (!a.colour.empty() || !b.colour.empty()) {
    joined.colour.resize(joined.patches.size());
    AddColour(a, to_a, joined.colour);
    AddColour(b, to_b, joined.colour);
  }
  AddVotes(a, to_a, joined.votes);
  AddVotes(b, to_b, joined.votes);
  Canonicalise(joined.votes);
  return joined;
}

MlsMap JoinMaps(const MlsMap& a, const MlsMap& b) {
  MlsMap joined;
  joined.parameters = a.parameters;
  auto next_a = a.tiles.begin();
  auto next_b = b.tiles.begin();
  while (next_a != a.tiles.end() && next_b != b.tiles.end()) {
    if (next_a->key == next_b->key) {
      joined.tiles.push_back(JoinTiles(*next_a++, *next_b++, a.parameters));
    } else {
      joined.tiles.push_back(next_a->key < next_b->key ? *next_a++ : *next_b++);
    }
  }
  joined.tiles.insert(joined.tiles.end(), next_a, a.tiles.end());
  joined.tiles.insert(joined.tiles.end(), next_b, b.tiles.end());
  return joined;
}

void JoinInto(MlsMap& map, const MlsMap& contribution) {
  std::vector<MlsTile> fresh;
  for (const MlsTile& tile : contribution.tiles) {
    const auto at = std::lower_bound(
        map.tiles.begin(), map.tiles.end(), tile.key, [](const MlsTile& t, const TileKey& key) {
          return t.key < key;
        });
    if (at != map.tiles.end() && at->key == tile.key) {
      *at = JoinTiles(*at, tile, map.parameters);
    } else {
      fresh.push_back(tile);
    }
  }
  if (fresh.empty()) return;
  const auto middle = static_cast<std::ptrdiff_t>(map.tiles.size());
  map.tiles.insert(map.tiles.end(),
                   std::make_move_iterator(fresh.begin()),
                   std::make_move_iterator(fresh.end()));
  std::inplace_merge(map.tiles.begin(),
                     map.tiles.begin() + middle,
                     map.tiles.end(),
                     [](const MlsTile& a, const MlsTile& b) { return a.key < b.key; });
}

MlsMap JoinAll(std::span<const MlsMap> maps, const MlsParameters& parameters) {
  if (maps.empty()) return {.parameters = parameters, .tiles = {}};
  if (maps.size() == 1) return maps.front();
  const std::size_t half = maps.size() / 2;
  return JoinMaps(JoinAll(maps.first(half), parameters), JoinAll(maps.subspan(half), parameters));
}

MlsMap TransformContribution(const MlsMap& local_map, const Pose& T_map_scan) {
  MlsMap map;
  map.parameters = local_map.parameters;
  const std::vector<MovedPatch> moved = MovePatches(local_map, T_map_scan);
  for (std::size_t begin = 0; begin < moved.size();) {
    std::size_t end = begin + 1;
    while (end < moved.size() && moved[end].tile == moved[begin].tile) ++end;
    map.tiles.push_back(TileOfMoved(std::span(moved).subspan(begin, end - begin), local_map));
    begin = end;
  }
  return map;
}

}  // namespace strata
