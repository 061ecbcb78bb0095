#include "client/sdk/remote_posegraph.h"

#include <string>
#include <utility>

#include "core/common/status.h"
#include "proto/translate/geometry.h"
#include "proto/translate/posegraph.h"
#include "proto/translate/scans.h"

namespace strata::sdk {

using translate::FromProto;
using translate::ToProto;

absl::StatusOr<api::PoseGraphState> RemotePoseGraph::Get(const api::Call& call,
                                                         absl::string_view map) {
  v1::GetPoseGraphRequest in;
  in.set_map(std::string(map));
  api::PoseGraphState state;
  const auto collect = [&state](const v1::GetPoseGraphResponse& out) -> absl::Status {
    state.epoch = out.epoch();
    for (const v1::PoseNode& node : out.nodes()) {
      STRATA_ASSIGN_OR_RETURN(PoseNode added, FromProto(node));
      state.nodes.push_back(std::move(added));
    }
    for (const v1::Constraint& constraint : out.constraints()) {
      STRATA_ASSIGN_OR_RETURN(Constraint added, FromProto(constraint));
      state.constraints.push_back(std::move(added));
    }
    return absl::OkStatus();
  };
  STRATA_RETURN_IF_ERROR(
      CallStream(connection_, *stub_, &v1::PoseGraph::Stub::Get, call, in, collect));
  return state;
}

absl::Status RemotePoseGraph::SetPose(const api::Call& call,
                                      absl::string_view map,
                                      const ScanId& id,
                                      const Pose& T_map_scan) {
  // A quaternion would make a rotation of what is none.
  STRATA_RETURN_IF_ERROR(ValidatePose(T_map_scan));
  v1::SetPoseRequest in;
  in.set_map(std::string(map));
  *in.mutable_id() = ToProto(id);
  *in.mutable_pose() = ToProto(T_map_scan);
  return CallUnary(connection_, *stub_, &v1::PoseGraph::Stub::SetPose, call, Repeat::kOnTrouble, in)
      .status();
}

}  // namespace strata::sdk
