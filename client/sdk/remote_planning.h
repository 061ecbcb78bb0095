// api::Planning over strata.v1.Planning.
#ifndef STRATA_CLIENT_SDK_REMOTE_PLANNING_H_
#define STRATA_CLIENT_SDK_REMOTE_PLANNING_H_

#include <memory>

#include "client/sdk/connection.h"
#include "core/api/planning.h"
#include "strata/v1/planning.grpc.pb.h"

namespace strata::sdk {

// Thread-safe.
class RemotePlanning final : public api::Planning {
 public:
  explicit RemotePlanning(Connection& connection)
      : connection_(connection), stub_(v1::Planning::NewStub(connection.channel())) {}

  absl::StatusOr<PlanResult> PlanPath(const api::Call& call,
                                      absl::string_view map,
                                      const PlanQuery& query) override;
  absl::StatusOr<PathCheck> CheckPath(const api::Call& call,
                                      absl::string_view map,
                                      const PathQuery& query) override;
  // Resumes by itself whenever the server comes back.
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
  Connection& connection_;
  const std::unique_ptr<v1::Planning::Stub> stub_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_PLANNING_H_
