#include "core/engine/doors/planning.h"

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/world/names.h"

namespace strata {

absl::StatusOr<PlanResult> EnginePlanning::PlanPath(const api::Call& call,
                                                    absl::string_view map,
                                                    const PlanQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.FindWithTiles(call, map));
  return found->planner().Plan(query, call.stop);
}

absl::StatusOr<PathCheck> EnginePlanning::CheckPath(const api::Call& call,
                                                    absl::string_view map,
                                                    const PathQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.FindWithTiles(call, map));
  return found->planner().Check(query, call.stop);
}

absl::Status EnginePlanning::WatchPath(const api::Call& call,
                                       absl::string_view map,
                                       const PathQuery& query,
                                       absl::FunctionRef<absl::Status(const PathCheck&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.FindWithTiles(call, map));
  return found->planner().Watch(query, call.stop, sink);
}

absl::StatusOr<FloorPlan> EnginePlanning::ListFloors(const api::Call& call,
                                                     absl::string_view map,
                                                     const FloorQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.FindWithTiles(call, map));
  return found->planner().Floors(query, call.stop);
}

absl::StatusOr<FloorPlaces> EnginePlanning::ListPlaces(const api::Call& call,
                                                       absl::string_view map,
                                                       const PlaceQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.FindWithTiles(call, map));
  return found->planner().Places(query, call.stop);
}

absl::StatusOr<ExploreResult> EnginePlanning::Explore(const api::Call& call,
                                                      absl::string_view map,
                                                      const ExploreQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.FindWithTiles(call, map));
  return found->planner().Explore(query, call.stop);
}

absl::StatusOr<ShapeCheck> EnginePlanning::CheckShape(const api::Call& call,
                                                      absl::string_view map,
                                                      const ShapeQuery& query) {
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.FindWithTiles(call, map));
  return found->planner().CheckShape(query, call.stop);
}

absl::StatusOr<std::vector<SurfaceColumn>> EnginePlanning::SampleSurfaces(
    const api::Call& call, absl::string_view map, const std::vector<Eigen::Vector2d>& places) {
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.FindWithTiles(call, map));
  return found->planner().Sample(places, call.stop);
}

absl::Status EnginePlanning::SetProfile(const api::Call& call,
                                        absl::string_view map,
                                        absl::string_view name,
                                        const RobotProfile& profile) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(call.stop, map));
  STRATA_RETURN_IF_ERROR(ValidateName("profile name", name));
  STRATA_RETURN_IF_ERROR(ValidateRobotProfile(profile));
  if (name == api::kDefaultProfile) {
    return found->worker().Execute(call.stop, [&](Integrator& integrator) {
      return integrator.SetDefaultProfile(profile, call.stop);
    });
  }
  return found->core().writer().Run(Durability::kFull, 0, call.stop, [&](StorageWriter& writer) {
    return writer.PutProfile(name, profile);
  });
}

absl::StatusOr<std::map<std::string, RobotProfile>> EnginePlanning::ListProfiles(
    const api::Call& call, absl::string_view map) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Map> found, maps_.Find(call.stop, map));
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, found->core().Reader());
  return reader->ListProfiles();
}

}  // namespace strata
