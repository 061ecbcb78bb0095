#include "tests/experiments/exploring/reached_ground.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/codec/surface_tile_codec.h"
#include "core/common/cache_budget.h"
#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/planning/endpoint.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/search.h"
#include "core/planning/search_space.h"
#include "core/planning/search_workspace.h"
#include "core/planning/tile_cache.h"
#include "tests/core/planning/memory_tiles.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;

constexpr double kSameLevelM = 0.2;
constexpr double kSameCellM = 0.01;  // middles of one cell are equal but for rounding

bool Before(const Vector3d& a, const Vector3d& b) {
  if (std::abs(a.x() - b.x()) > kSameCellM) return a.x() < b.x();
  if (std::abs(a.y() - b.y()) > kSameCellM) return a.y() < b.y();
  return a.z() < b.z();
}

absl::StatusOr<std::vector<SurfaceTile>> AllTiles(api::Database& db, absl::string_view map) {
  std::vector<SurfaceTile> tiles;
  STRATA_RETURN_IF_ERROR(
      db.tiles().Fetch({}, map, {}, {}, [&](const api::TileUpdate& update) -> absl::Status {
        STRATA_ASSIGN_OR_RETURN(SurfaceTile tile, DecodeSurfaceTile(update.tile.bytes));
        tile.key = update.tile.key;
        tile.version = update.tile.version;
        tiles.push_back(std::move(tile));
        return absl::OkStatus();
      }));
  return tiles;
}

}  // namespace

absl::StatusOr<std::vector<Vector3d>> ReachedGround(api::Database& db,
                                                    absl::string_view map,
                                                    const RobotProfile& profile,
                                                    const PlanEndpoint& from) {
  STRATA_ASSIGN_OR_RETURN(const MapInfo info, db.maps().Get({}, map));
  STRATA_ASSIGN_OR_RETURN(std::vector<SurfaceTile> tiles, AllTiles(db, map));
  MemoryTiles source(std::move(tiles));
  TileCache cache(std::make_shared<CacheBudget>(std::size_t{1} << 30));
  STRATA_ASSIGN_OR_RETURN(const ProfileChecks checks,
                          MakeProfileChecks(profile, info.parameters.mls.cell_size_m));
  SearchSpace space(cache, source, checks);
  STRATA_ASSIGN_OR_RETURN(const EndpointMatch start, MatchEndpoint(space, from));
  if (start.patch == kNoPatchId) return absl::NotFoundError(absl::StrCat("start: ", start.message));
  SearchWorkspace workspace;
  STRATA_RETURN_IF_ERROR(ReachAll(space, start.patch, workspace, Stop()).status());
  std::vector<Vector3d> places;
  ForEachReached(space, workspace, kAnyCost, [&](PatchId patch, std::uint32_t /*cost*/) {
    places.push_back(space.Position(patch));
  });
  STRATA_RETURN_IF_ERROR(space.status());
  std::sort(places.begin(), places.end(), Before);
  return places;
}

std::vector<Vector3d> NotReached(const std::vector<Vector3d>& all,
                                 const std::vector<Vector3d>& reached) {
  std::vector<Vector3d> missing;
  for (const Vector3d& place : all) {
    const Vector3d lowest = place - kSameLevelM * Vector3d::UnitZ();
    const auto found = std::lower_bound(reached.begin(), reached.end(), lowest, Before);
    if (found == reached.end() || Before(place + kSameLevelM * Vector3d::UnitZ(), *found)) {
      missing.push_back(place);
    }
  }
  return missing;
}

}  // namespace strata::testing
