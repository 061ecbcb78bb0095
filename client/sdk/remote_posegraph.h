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

 private:
  Connection& connection_;
  const std::unique_ptr<v1::PoseGraph::Stub> stub_;
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_REMOTE_POSEGRAPH_H_
