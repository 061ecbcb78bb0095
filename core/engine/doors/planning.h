// api::Planning on the maps of an engine.
#ifndef STRATA_CORE_ENGINE_DOORS_PLANNING_H_
#define STRATA_CORE_ENGINE_DOORS_PLANNING_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/planning.h"
#include "core/engine/doors/kept_elsewhere.h"
#include "core/engine/doors/map_reading.h"
#include "core/engine/doors/maps.h"
#include "core/engine/map/map_state.h"
#include "core/engine/plans/map_planner.h"

namespace strata {

class EnginePlanning final : public api::Planning {
 public:
  explicit EnginePlanning(EngineMaps& maps) : maps_(maps), elsewhere_(maps.options()) {}

  absl::StatusOr<PlanResult> PlanPath(const api::Call& call,
                                      absl::string_view map,
                                      const PlanQuery& query) override;
  absl::StatusOr<PathCheck> CheckPath(const api::Call& call,
                                      absl::string_view map,
                                      const PathQuery& query) override;
  absl::Status WatchPath(const api::Call& call,
                         absl::string_view map,
                         const PathQuery& query,
                         absl::FunctionRef<absl::Status(const PathCheck&)> sink) override;
  absl::StatusOr<FloorPlan> ListFloors(const api::Call& call,
                                       absl::string_view map,
                                       const FloorQuery& query) override;
  absl::StatusOr<FloorPlaces> ListPlaces(const api::Call& call,
                                         absl::string_view map,
                                         const PlaceQuery& query) override;
  absl::StatusOr<ExploreResult> Explore(const api::Call& call,
                                        absl::string_view map,
                                        const ExploreQuery& query) override;
  absl::StatusOr<ShapeCheck> CheckShape(const api::Call& call,
                                        absl::string_view map,
                                        const ShapeQuery& query) override;
  absl::StatusOr<std::vector<SurfaceColumn>> SampleSurfaces(
      const api::Call& call,
      absl::string_view map,
      const std::vector<Eigen::Vector2d>& places) override;
  absl::Status SetProfile(const api::Call& call,
                          absl::string_view map,
                          absl::string_view name,
                          const RobotProfile& profile) override;
  absl::StatusOr<std::map<std::string, RobotProfile>> ListProfiles(const api::Call& call,
                                                                   absl::string_view map) override;

 private:
  // Asks the map's planner, whoever has the map, about its newest state with what changed after
  // `since`.
  absl::Status Ask(const MapReading& map,
                   std::uint64_t since,
                   absl::FunctionRef<absl::Status(MapPlanner&, MapState&)> body);
  // The same for what does not ask for changes.
  template <typename Answer>
  absl::StatusOr<Answer> Ask(
      const api::Call& call,
      absl::string_view map,
      absl::FunctionRef<absl::StatusOr<Answer>(MapPlanner&, MapState&)> body);
  absl::StatusOr<PathCheck> Check(const MapReading& map, const PathQuery& query, const Stop& stop);

  EngineMaps& maps_;
  // What they keep is keyed by the versions of tiles, which belong to their bytes for ever, so none
  // of it is ever stale; how much, the caches of all maps say together.
  KeptElsewhere<MapPlanner> elsewhere_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_PLANNING_H_
