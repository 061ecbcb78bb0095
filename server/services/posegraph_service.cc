#include "server/services/posegraph_service.h"

#include "core/common/status.h"
#include "proto/translate/geometry.h"
#include "proto/translate/posegraph.h"
#include "proto/translate/scans.h"
#include "server/rpc/stream.h"
#include "server/services/localize_reactor.h"
#include "server/services/track_reactor.h"

namespace strata::server {
namespace {

using translate::FromProto;
using translate::ToProto;

constexpr std::size_t kMaxPartsPerMessage = 1024;

absl::Status Get(api::Database& db,
                 const api::Call& call,
                 const v1::GetPoseGraphRequest& in,
                 StreamSink<v1::GetPoseGraphResponse> sink) {
  STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState state, db.posegraph().Get(call, in.map()));
  v1::GetPoseGraphResponse out;
  out.set_epoch(state.epoch);
  std::size_t parts = 0;
  const auto count = [&](std::size_t added) -> absl::Status {
    parts += added;
    if (parts < kMaxPartsPerMessage) return absl::OkStatus();
    STRATA_RETURN_IF_ERROR(sink(out));
    parts = 0;
    out.Clear();
    out.set_epoch(state.epoch);
    return absl::OkStatus();
  };
  for (const PoseNode& node : state.nodes) {
    *out.add_nodes() = ToProto(node);
    STRATA_RETURN_IF_ERROR(count(1));
  }
  for (const Constraint& constraint : state.constraints) {
    *out.add_constraints() = ToProto(constraint);
    STRATA_RETURN_IF_ERROR(count(1));
  }
  for (const GlobalPlane& plane : state.planes) {
    *out.add_planes() = ToProto(plane);
    STRATA_RETURN_IF_ERROR(count(1 + plane.supports.size()));
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

absl::Status AddConstraint(api::Database& db,
                           const api::Call& call,
                           const v1::AddConstraintRequest& in,
                           v1::AddConstraintResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const Constraint constraint,
                          AtTheDoor(translate::NewConstraintFromProto(in.constraint())));
  STRATA_ASSIGN_OR_RETURN(const Constraint added,
                          db.posegraph().AddConstraint(call, in.map(), constraint));
  *out.mutable_constraint() = ToProto(added);
  return absl::OkStatus();
}

absl::Status RemoveConstraint(api::Database& db,
                              const api::Call& call,
                              const v1::RemoveConstraintRequest& in,
                              v1::RemoveConstraintResponse&) {
  return db.posegraph().RemoveConstraint(call, in.map(), in.id());
}

absl::Status EnableConstraint(api::Database& db,
                              const api::Call& call,
                              const v1::EnableConstraintRequest& in,
                              v1::EnableConstraintResponse&) {
  return db.posegraph().EnableConstraint(call, in.map(), in.id(), in.enabled());
}

absl::Status LookupPose(api::Database& db,
                        const api::Call& call,
                        const v1::LookupPoseRequest& in,
                        v1::LookupPoseResponse& out) {
  STRATA_ASSIGN_OR_RETURN(const api::PoseLookup lookup,
                          db.posegraph().LookupPose(call, in.map(), FromProto(in.id())));
  out = ToProto(lookup);
  return absl::OkStatus();
}

}  // namespace

PoseGraphService::PoseGraphService(Runtime& runtime) : Service(runtime, "PoseGraph") {
  Stream("Get", &Get);
  Unary("SetPose", &SetPose);
  Unary("AddConstraint", &AddConstraint);
  Unary("RemoveConstraint", &RemoveConstraint);
  Unary("EnableConstraint", &EnableConstraint);
  Unary("LookupPose", &LookupPose);
  Receive<LocalizeReactor>("Localize");
  Exchange<TrackReactor>("Track");
}

}  // namespace strata::server
