#include "core/engine/plans/map_planner.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <glog/logging.h>

#include "core/classification/places/places.h"
#include "core/collision/shape_way.h"
#include "core/common/log_line.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/engine/map/change_log.h"
#include "core/engine/map/parallel.h"
#include "core/engine/tiles/kept_tiles.h"
#include "core/engine/tiles/surface_tiles.h"
#include "core/engine/tiles/tile_check.h"
#include "core/planning/floors/floors.h"
#include "core/planning/path_check.h"
#include "core/planning/tile_source.h"

namespace strata {
namespace {

// One part of the caches in so many is for decoded tiles: prepared ones are asked for more often.
constexpr std::size_t kDecodedShare = 16;

// One processor is left to those whose tiles are there.
int PreparationsAtATime() {
  return std::clamp(static_cast<int>(std::thread::hardware_concurrency()) - 1, 1, 2);
}

// Whether an answer given before is the one that would be given now. What a robot may do in a tile
// depends on the tiles around it too.
bool StillKnown(const PathCheck& known,
                const PathQuery& query,
                const ChangeSet& changes,
                double cell_size_m) {
  if (!changes.complete || known.commit_sequence > changes.last) return false;
  if (query.inferred == InferredAs::kObstacle && changes.inferred > known.commit_sequence) {
    return false;
  }
  if (!ValidateWaypoints(query.waypoints, cell_size_m).ok() ||
      known.tiles != TilesUnder(query.waypoints, cell_size_m)) {
    return false;
  }
  const absl::btree_set<TileKey> around = WithNeighbours({known.tiles.begin(), known.tiles.end()});
  return std::none_of(changes.tiles.begin(), changes.tiles.end(), [&](const auto& change) {
    return around.contains(change.first);
  });
}

absl::Status NoSuchFloor(const PlaceQuery& query, std::size_t floors) {
  if (query.at.has_value()) {
    return absl::NotFoundError(
        absl::StrCat("no floor of 10 m² or more at ", query.at->x_m, ", ", query.at->y_m));
  }
  if (floors == 0) return absl::NotFoundError("the map has no floor for this robot");
  return absl::NotFoundError(
      absl::StrCat("no floor ", *query.floor, "; the map has 0 to ", floors - 1));
}

}  // namespace

// The tiles of one state.
class MapPlanner::Source final : public TileSource {
 public:
  Source(MapPlanner& planner,
         MapState& state,
         std::shared_ptr<const TileVersionMap> versions,
         std::shared_ptr<const InferredState> inferred)
      : planner_(planner),
        state_(state),
        versions_(std::move(versions)),
        inferred_(std::move(inferred)) {}

  absl::StatusOr<std::shared_ptr<const SurfaceTile>> Load(const TileKey& key) override {
    const std::uint64_t version = Version(key);
    if (version == 0) return std::shared_ptr<const SurfaceTile>();
    return planner_.LoadTile(state_, key, version);
  }
  std::uint64_t Version(const TileKey& key) override {
    const auto it = versions_->find(key);
    return it == versions_->end() ? 0 : it->second;
  }
  absl::StatusOr<std::optional<std::string>> LoadPrepared(const TileKey& key,
                                                          const TileVersions& versions,
                                                          const RobotProfile& profile) override {
    return planner_.LoadPrepared(state_, key, MadeOf(versions, profile));
  }
  std::shared_ptr<const InferredTile> Inferred(const TileKey& key) override {
    if (inferred_ == nullptr) return nullptr;
    const auto found = inferred_->tiles.find(key);
    return found == inferred_->tiles.end() ? nullptr : found->second;
  }
  std::uint64_t epoch() const { return state_.view().epoch; }
  // Says behind `message` what whoever asked for what was inferred should know of it.
  void RemarkOnInferred(std::string& message) const {
    if (inferred_ == nullptr || inferred_->epoch == epoch()) return;
    if (!message.empty()) message += "; ";
    if (!inferred_->epoch.has_value()) {
      message += "nothing is inferred in this map (objects complete)";
      return;
    }
    absl::StrAppend(&message,
                    "what is inferred is of epoch ",
                    *inferred_->epoch,
                    ", the map's is ",
                    epoch(),
                    " (objects find and objects complete)");
  }
  std::vector<TileKey> Keys() const {
    std::vector<TileKey> keys;
    for (const auto& [key, version] : *versions_) {
      if (key.level == 0) keys.push_back(key);
    }
    std::sort(keys.begin(), keys.end());
    return keys;
  }

  static absl::StatusOr<Source> Of(MapPlanner& planner,
                                   MapState& state,
                                   InferredAs as = InferredAs::kIgnore,
                                   const Stop& stop = {}) {
    STRATA_ASSIGN_OR_RETURN(std::shared_ptr<const TileVersionMap> versions,
                            planner.VersionsOf(state));
    std::shared_ptr<const InferredState> inferred;
    if (as == InferredAs::kObstacle) {
      STRATA_ASSIGN_OR_RETURN(inferred, planner.inferred_.Now(state, stop));
    }
    return Source(planner, state, std::move(versions), std::move(inferred));
  }

 private:
  MapPlanner& planner_;
  MapState& state_;
  std::shared_ptr<const TileVersionMap> versions_;
  std::shared_ptr<const InferredState> inferred_;  // nullptr: not asked for
};

MapPlanner::MapPlanner(std::string name,
                       const MapParameters& parameters,
                       const EngineOptions& options,
                       const std::shared_ptr<CacheBudget>& caches)
    : name_(std::move(name)),
      cell_size_m_(parameters.mls.cell_size_m),
      planner_({.cell_size_m = cell_size_m_,
                .budget = caches,
                .loop =
                    [threads = options.worker_threads](
                        std::size_t count, absl::FunctionRef<absl::Status(std::size_t)> body) {
                      return ParallelFor(
                          threads, count, [&](int /*thread*/, std::size_t i) { return body(i); });
                    },
                .preparations = PreparationsAtATime()}),
      spaces_(name_, parameters, caches),
      inferred_(cell_size_m_, caches),
      tiles_(caches, options.cache_bytes / kDecodedShare) {}

absl::StatusOr<std::shared_ptr<const TileVersionMap>> MapPlanner::VersionsOf(MapState& state) {
  const MapView& view = state.view();
  {
    absl::MutexLock lock(&mutex_);
    if (versions_ != nullptr && versions_view_ == view) return versions_;
  }
  std::shared_ptr<const TileVersionMap> versions;
  {
    STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state.Reader());
    STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceTileRow> rows,
                            reader->ListSurfaceTiles(TileRange{}, view.tile_version));
    versions = std::make_shared<const TileVersionMap>(VersionsOfTiles(rows));
  }
  absl::MutexLock lock(&mutex_);
  versions_view_ = view;
  versions_ = versions;
  return versions_;
}

absl::StatusOr<std::shared_ptr<const SurfaceTile>> MapPlanner::LoadTile(MapState& state,
                                                                        const TileKey& key,
                                                                        std::uint64_t version) {
  const auto held = tiles_.Find(key);
  if (held != nullptr && held->version == version) return held->tile;
  std::optional<SurfaceTileRow> row;
  {
    STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state.Reader());
    STRATA_ASSIGN_OR_RETURN(row, reader->FindSurfaceTile(key, version));
  }
  STRATA_ASSIGN_OR_RETURN(std::shared_ptr<const SurfaceTile> tile, DecodeStoredTile(key, row));
  if (tile == nullptr) return tile;
  tiles_.Put(key,
             std::make_shared<const Decoded>(Decoded{version, tile}),
             sizeof(SurfaceTile) + tile->surfaces.capacity() * sizeof(Surface));
  return tile;
}

absl::StatusOr<std::optional<std::string>> MapPlanner::LoadPrepared(MapState& state,
                                                                    const TileKey& key,
                                                                    const std::string& made_of) {
  std::optional<std::string> bytes;
  {
    STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state.Reader());
    STRATA_ASSIGN_OR_RETURN(bytes, reader->FindPreparedTile(key, made_of));
  }
  if (!bytes.has_value()) return bytes;
  absl::StatusOr<std::string> packed = UnsealTile(key, made_of, *std::move(bytes));
  if (packed.ok()) return std::optional<std::string>(*std::move(packed));
  LOG(WARNING) << LogLine("prepare").Add("map", name_).Add("damaged", key.ToString());
  state.NoteUnreadable(key);
  return std::optional<std::string>();
}

absl::StatusOr<PlanResult> MapPlanner::Plan(MapState& state,
                                            const PlanQuery& query,
                                            const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(Source source, Source::Of(*this, state, query.inferred, stop));
  STRATA_ASSIGN_OR_RETURN(PlanResult result, planner_.Plan(source, query, stop));
  source.RemarkOnInferred(result.message);
  result.epoch = state.view().epoch;
  return result;
}

absl::StatusOr<PathCheck> MapPlanner::Check(MapState& state,
                                            const PathQuery& query,
                                            const Stop& stop) {
  const ChangeSet& changes = state.changes();
  PathCheck check;
  if (query.known.has_value() && StillKnown(*query.known, query, changes, cell_size_m_)) {
    check = *query.known;
  } else {
    STRATA_ASSIGN_OR_RETURN(Source source, Source::Of(*this, state, query.inferred, stop));
    STRATA_ASSIGN_OR_RETURN(check, planner_.Check(source, query, stop));
    source.RemarkOnInferred(check.message);
  }
  check.epoch = state.view().epoch;
  check.commit_sequence = changes.last;
  return check;
}

absl::StatusOr<FloorPlan> MapPlanner::Floors(MapState& state,
                                             const FloorQuery& query,
                                             const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(Source source, Source::Of(*this, state, query.inferred, stop));
  STRATA_ASSIGN_OR_RETURN(
      FloorPlan plan,
      FindFloors(planner_.cache(), source, source.Keys(), cell_size_m_, query, stop));
  source.RemarkOnInferred(plan.message);
  plan.epoch = state.view().epoch;
  plan.commit_sequence = state.changes().last;
  return plan;
}

absl::StatusOr<FloorPlaces> MapPlanner::Places(MapState& state,
                                               const PlaceQuery& query,
                                               const Stop& stop) {
  FloorQuery floors{.profile = query.profile,
                    .at = query.at,
                    .cells = true,
                    .floor = query.floor,
                    .inferred = query.inferred};
  const bool largest = !query.at.has_value() && !query.floor.has_value();
  if (largest) floors.floor = 0;
  STRATA_ASSIGN_OR_RETURN(const FloorPlan plan, Floors(state, floors, stop));
  FloorPlaces places;
  places.message = plan.message;
  places.cell_size_m = plan.cell_size_m;
  places.epoch = plan.epoch;
  places.commit_sequence = plan.commit_sequence;
  if (largest && plan.floors.empty()) return places;
  places.floor = query.at.has_value() ? plan.at : floors.floor;
  if (!places.floor.has_value() || static_cast<std::size_t>(*places.floor) >= plan.floors.size()) {
    return NoSuchFloor(query, plan.floors.size());
  }
  STRATA_ASSIGN_OR_RETURN(places.places,
                          FindPlaces(plan.floors[static_cast<std::size_t>(*places.floor)].blocks,
                                     plan.cell_size_m,
                                     query.cells,
                                     stop));
  return places;
}

absl::StatusOr<ExploreResult> MapPlanner::Explore(MapState& state,
                                                  const ExploreQuery& query,
                                                  const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(Source source, Source::Of(*this, state, query.inferred, stop));
  const auto space_of = [&](const Eigen::AlignedBox3d& region, double voxel_m) {
    return spaces_.Find(state, region, voxel_m, stop);
  };
  STRATA_ASSIGN_OR_RETURN(ExploreResult result, planner_.Explore(source, query, space_of, stop));
  source.RemarkOnInferred(result.message);
  result.epoch = state.view().epoch;
  return result;
}

absl::StatusOr<ShapeCheck> MapPlanner::CheckShape(MapState& state,
                                                  const ShapeQuery& query,
                                                  const Stop& stop) {
  const absl::Time begin = SteadyNow();
  STRATA_RETURN_IF_ERROR(stop.status());
  STRATA_ASSIGN_OR_RETURN(Source source, Source::Of(*this, state, query.inferred, stop));
  STRATA_ASSIGN_OR_RETURN(
      ShapeCheck check,
      CheckShapeAlong([&source](const TileKey& key) { return source.Load(key); },
                      cell_size_m_,
                      query,
                      stop,
                      [&source](const TileKey& key) { return source.Inferred(key); }));
  source.RemarkOnInferred(check.message);
  check.epoch = state.view().epoch;
  check.elapsed_ms = absl::ToDoubleMilliseconds(SteadyNow() - begin);
  return check;
}

absl::StatusOr<std::vector<SurfaceColumn>> MapPlanner::Sample(
    MapState& state, const std::vector<Eigen::Vector2d>& places, const Stop& stop) {
  constexpr std::size_t kStopInterval = 1024;
  STRATA_ASSIGN_OR_RETURN(Source source, Source::Of(*this, state));
  std::vector<SurfaceColumn> columns;
  columns.reserve(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (i % kStopInterval == 0) STRATA_RETURN_IF_ERROR(stop.status());
    if (!places[i].allFinite()) {
      return absl::InvalidArgumentError(absl::StrCat("place ", i, " is not finite"));
    }
    SurfaceColumn& column = columns.emplace_back();
    column.x_m = places[i].x();
    column.y_m = places[i].y();
    const Eigen::Vector2d cell = (places[i] / cell_size_m_).array().floor();
    if (cell.cwiseAbs().maxCoeff() >= kMaxCellIndex) continue;
    const CellIndex index{static_cast<std::int32_t>(cell.x()), static_cast<std::int32_t>(cell.y())};
    STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<const SurfaceTile> tile,
                            source.Load(TileOfCell(index)));
    if (tile == nullptr) continue;
    const auto surfaces = tile->Cell(CellInTile(index));
    column.surfaces.assign(surfaces.begin(), surfaces.end());
  }
  return columns;
}

}  // namespace strata
