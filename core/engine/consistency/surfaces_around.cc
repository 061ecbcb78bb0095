#include "core/engine/consistency/surfaces_around.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/status/status.h"

#include "core/codec/surface_tile_codec.h"
#include "core/common/status.h"
#include "core/engine/scans/scan_source.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

// Of the places; heights are relative to theirs, in single precision.
constexpr double kStepM = kSurfacesSlackM;
constexpr double kHeightStepM = 200.0;

// Finest tiles whose cells are about as wide as those that scans are matched with: of finer maps an
// overview.
std::int32_t LevelOf(double cell_size_m) {
  std::int32_t level = 0;
  while (level < kMaxLevel && std::ldexp(cell_size_m, level + 1) <= kRegistrationCellM) ++level;
  return level;
}

TileRange RangeAround(const Eigen::Vector3d& centre, double cell_size_m, std::int32_t level) {
  const double tile_m = kTileCells * std::ldexp(cell_size_m, level);
  const double radius_m = kTrackedRangeM + kSurfacesSlackM;
  const auto tile_of = [&](double at_m) {
    return static_cast<std::int64_t>(std::floor(std::clamp(at_m / tile_m, -1e9, 1e9)));
  };
  return {level,
          tile_of(centre.x() - radius_m),
          tile_of(centre.x() + radius_m) + 1,
          tile_of(centre.y() - radius_m),
          tile_of(centre.y() + radius_m) + 1};
}

// From the centre of the tile [tiles²].
double SquaredDistance(const TileKey& key, const Eigen::Vector3d& centre, double cell_size_m) {
  const double tile_m = kTileCells * std::ldexp(cell_size_m, key.level);
  const Eigen::Vector2d tile(key.x + 0.5, key.y + 0.5);
  return (tile - centre.head<2>() / tile_m).squaredNorm();
}

}  // namespace

PlaceKey NearestPlace(const Eigen::Vector3d& p_map) {
  const auto nearest = [](double at_m, double step_m) {
    return static_cast<std::int64_t>(std::llround(std::clamp(at_m / step_m, -1e12, 1e12)));
  };
  return {nearest(p_map.x(), kStepM), nearest(p_map.y(), kStepM), nearest(p_map.z(), kHeightStepM)};
}

Eigen::Vector3d CentreOf(const PlaceKey& place) {
  return {static_cast<double>(place.x) * kStepM,
          static_cast<double>(place.y) * kStepM,
          static_cast<double>(place.z) * kHeightStepM};
}

SurfacesAround::Handle SurfacesAround::FindAtHand(const PlaceKey& place, const MapView& view) {
  return known_.Find({place, view});
}

absl::StatusOr<SurfacesAround::Handle> SurfacesAround::Find(const PlaceKey& place,
                                                            const MapState& state,
                                                            const Stop& stop) {
  if (Handle known = FindAtHand(place, state.view()); known != nullptr) return known;
  STRATA_ASSIGN_OR_RETURN(MapSurfaces collected, Collect(CentreOf(place), state, stop));
  auto surfaces = std::make_shared<const MapSurfaces>(std::move(collected));
  known_.Put({place, state.view()},
             surfaces,
             surfaces->features.memory_bytes() + surfaces->target.memory_bytes());
  return surfaces;
}

absl::StatusOr<std::optional<SurfaceTile>> SurfacesAround::ReadTile(const TileKey& key,
                                                                    const MapState& state) {
  if (tiles_ != nullptr && state.open_here()) {
    STRATA_ASSIGN_OR_RETURN(const ServedTiles::Handle served, tiles_->Find(key, state.view()));
    if (served == nullptr) return std::nullopt;
    return DecodeSurfaceTile(served->bytes);
  }
  STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state.Reader());
  STRATA_ASSIGN_OR_RETURN(const std::optional<SurfaceTileRow> row,
                          reader->FindSurfaceTile(key, state.view().tile_version));
  if (!row.has_value()) return std::nullopt;
  return DecodeSurfaceTile(row->bytes);
}

absl::StatusOr<MapSurfaces> SurfacesAround::Collect(const Eigen::Vector3d& centre,
                                                    const MapState& state,
                                                    const Stop& stop) {
  const double cell_size_m = parameters_.mls.cell_size_m;
  std::vector<SurfaceTileRow> rows;
  {
    STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state.Reader());
    STRATA_ASSIGN_OR_RETURN(
        rows,
        reader->ListSurfaceTiles(RangeAround(centre, cell_size_m, LevelOf(cell_size_m)),
                                 state.view().tile_version));
  }
  std::stable_sort(rows.begin(), rows.end(), [&](const SurfaceTileRow& a, const SurfaceTileRow& b) {
    return SquaredDistance(a.key, centre, cell_size_m) <
           SquaredDistance(b.key, centre, cell_size_m);
  });
  MapSurfacesCollector collector(centre, cell_size_m, parameters_.keep_points);
  for (const SurfaceTileRow& row : rows) {
    STRATA_RETURN_IF_ERROR(stop.status());
    const absl::StatusOr<std::optional<SurfaceTile>> tile = ReadTile(row.key, state);
    if (absl::IsDataLoss(tile.status())) continue;
    STRATA_RETURN_IF_ERROR(tile.status());
    if (tile->has_value() && !collector.Add(**tile)) break;
  }
  return std::move(collector).Finish();
}

}  // namespace strata
