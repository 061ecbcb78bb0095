// api::PoseGraph over strata.v1.PoseGraph.
#ifndef STRATA_CLIENT_SDK_REMOTE_POSEGRAPH_H_
#define STRATA_CLIENT_SDK_REMOTE_POSEGRAPH_H_

#include <memory>

#include "client/sdk/connection.h"
#include "core/api/posegraph.h"
#include "strata/v1/posegraph.grpc.pb.h"

namespace strata::sdk {

// Thread-safe.
class RemotePoseGraph final : public api::PoseGraph {
 public:
  explicit RemotePoseGraph(Connection& connection)
      : connection_(connection), stub_(v1::PoseGraph::NewStub(connection.channel())) {}

  absl::StatusOr<api::PoseGraphState> Get(const api::Call& call, absl::string_view map) override;
  absl::Status SetPose(const api::Call& call,
                       absl::string_view map,
                       const ScanId& id,
                       const Pose& T_map_scan) override;
  absl::StatusOr<Constraint> AddConstraint(const api::Call& call,
                                           absl::string_view map,
                                           const Constraint& constraint) override;
  absl::Status RemoveConstraint(const api::Call& call,
                                absl::string_view map,
                                std::uint64_t id) override;
  absl::Status EnableConstraint(const api::Call& call,
                                absl::string_view map,
                                std::uint64_t id,
                                bool enabled) override;
  absl::StatusOr<api::PoseLookup> LookupPose(const api::Call& call,
                                             absl::string_view map,
                                             const ScanId& id) override;
  // Sends the points' coordinates only.
  absl::StatusOr<LocalizeResult> Localize(const api::Call& call,
                                          absl::string_view map,
                                          const LocalizeQuery& query) override;
  absl::StatusOr<std::unique_ptr<api::Tracking>> Track(const api::Call& call,
                                                       absl::string_view map,
                                                       const TrackStart& start) override;

 private:
  Connection& connection_;
  const std::unique_ptr<v1::PoseGraph::Stub> stub_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_POSEGRAPH_H_
