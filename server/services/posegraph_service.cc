#include "server/services/posegraph_service.h"

#include "core/common/status.h"
#include "proto/translate/geometry.h"
#include "proto/translate/posegraph.h"
#include "proto/translate/scans.h"
#include "server/rpc/stream.h"
#include "server/rpc/unary.h"

namespace strata::server {
namespace {

using translate::FromProto;
using translate::ToProto;

constexpr int kMaxPartsPerMessage = 1024;

absl::Status Get(api::Database& db,
                 const api::Call& call,
                 const v1::GetPoseGraphRequest& in,
                 StreamSink<v1::GetPoseGraphResponse> sink) {
  STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState state, db.posegraph().Get(call, in.map()));
  v1::GetPoseGraphResponse out;
  out.set_epoch(state.epoch);
  for (const PoseNode& node : state.nodes) {
    *out.add_nodes() = ToProto(node);
    if (out.nodes_size() < kMaxPartsPerMessage) continue;
    STRATA_RETURN_IF_ERROR(sink(out));
    out.clear_nodes();
  }
  for (const Constraint& constraint : state.constraints) {
    *out.add_constraints() = ToProto(constraint);
    if (out.constraints_size() < kMaxPartsPerMessage) continue;
    STRATA_RETURN_IF_ERROR(sink(out));
    out.clear_nodes();
    out.clear_constraints();
  }
  // Also the only message of an empty graph, for its epoch.
  return sink(out);
}

absl::Status SetPose(api::Database& db,
                     const api::Call& call,
                     const v1::SetPoseRequest& in,
                     v1::SetPoseResponse&) {
  STRATA_ASSIGN_OR_RETURN(const Pose T_map_scan, AtTheDoor(FromProto("pose", in.pose())));
  return db.posegraph().SetPose(call, in.map(), FromProto(in.id()), T_map_scan);
}

}  // namespace

grpc::ServerWriteReactor<v1::GetPoseGraphResponse>* PoseGraphService::Get(
    grpc::CallbackServerContext* context, const v1::GetPoseGraphRequest* in) {
  return RunStream(runtime_, context, "PoseGraph.Get", in, &server::Get);
}

grpc::ServerUnaryReactor* PoseGraphService::SetPose(grpc::CallbackServerContext* context,
                                                    const v1::SetPoseRequest* in,
                                                    v1::SetPoseResponse* out) {
  return RunUnary(runtime_, context, "PoseGraph.SetPose", in, out, &server::SetPose);
}

}  // namespace strata::server
