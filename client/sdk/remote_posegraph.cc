#include "client/sdk/remote_posegraph.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "client/sdk/backoff.h"
#include "client/sdk/remote_tracking.h"
#include "core/api/scans.h"
#include "core/common/status.h"
#include "proto/translate/geometry.h"
#include "proto/translate/localize.h"
#include "proto/translate/points.h"
#include "proto/translate/posegraph.h"
#include "proto/translate/scans.h"

namespace strata::sdk {

using translate::FromProto;
using translate::ToProto;

namespace {

// The points from `begin` on that fit a message.
v1::LocalizeRequest NextChunk(const PointCloud& cloud, std::size_t begin) {
  const std::size_t end = std::min(cloud.size(), begin + api::kMaxPointsPerChunk);
  PointCloud piece;
  piece.points.assign(cloud.points.begin() + static_cast<std::ptrdiff_t>(begin),
                      cloud.points.begin() + static_cast<std::ptrdiff_t>(end));
  v1::LocalizeRequest message;
  *message.mutable_chunk() = ToProto(piece);
  return message;
}

// One attempt.
absl::StatusOr<v1::LocalizeResponse> SendQuery(Connection& connection,
                                               v1::PoseGraph::Stub& stub,
                                               const api::Call& call,
                                               absl::string_view map,
                                               const LocalizeQuery& query) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  AttemptContext context(connection, call);
  v1::LocalizeResponse out;
  const auto writer = stub.Localize(context.get(), &out);
  v1::LocalizeRequest start;
  *start.mutable_start() = ToProto(map, query);
  bool goes_on = writer->Write(start);
  for (std::size_t i = 0; goes_on && i < query.cloud.size(); i += api::kMaxPointsPerChunk) {
    goes_on = writer->Write(NextChunk(query.cloud, i));
  }
  // The server refuses early by ending the stream; why is in its status.
  if (goes_on) writer->WritesDone();
  STRATA_RETURN_IF_ERROR(StatusOf(writer->Finish(), call));
  return out;
}

}  // namespace

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
    for (const v1::GlobalPlane& plane : out.planes()) {
      STRATA_ASSIGN_OR_RETURN(GlobalPlane added, FromProto(plane));
      state.planes.push_back(std::move(added));
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

absl::StatusOr<Constraint> RemotePoseGraph::AddConstraint(const api::Call& call,
                                                          absl::string_view map,
                                                          const Constraint& constraint) {
  // A quaternion would make a rotation of what is none.
  STRATA_RETURN_IF_ERROR(ValidateConstraint(constraint));
  v1::AddConstraintRequest in;
  in.set_map(std::string(map));
  *in.mutable_constraint() = ToProto(constraint);
  STRATA_ASSIGN_OR_RETURN(
      const v1::AddConstraintResponse out,
      CallUnary(
          connection_, *stub_, &v1::PoseGraph::Stub::AddConstraint, call, Repeat::kNever, in));
  return FromProto(out.constraint());
}

absl::Status RemotePoseGraph::RemoveConstraint(const api::Call& call,
                                               absl::string_view map,
                                               std::uint64_t id) {
  v1::RemoveConstraintRequest in;
  in.set_map(std::string(map));
  in.set_id(id);
  return CallUnary(
             connection_, *stub_, &v1::PoseGraph::Stub::RemoveConstraint, call, Repeat::kNever, in)
      .status();
}

absl::Status RemotePoseGraph::EnableConstraint(const api::Call& call,
                                               absl::string_view map,
                                               std::uint64_t id,
                                               bool enabled) {
  v1::EnableConstraintRequest in;
  in.set_map(std::string(map));
  in.set_id(id);
  in.set_enabled(enabled);
  return CallUnary(connection_,
                   *stub_,
                   &v1::PoseGraph::Stub::EnableConstraint,
                   call,
                   Repeat::kOnTrouble,
                   in)
      .status();
}

absl::StatusOr<api::PoseLookup> RemotePoseGraph::LookupPose(const api::Call& call,
                                                            absl::string_view map,
                                                            const ScanId& id) {
  v1::LookupPoseRequest in;
  in.set_map(std::string(map));
  *in.mutable_id() = ToProto(id);
  STRATA_ASSIGN_OR_RETURN(
      const v1::LookupPoseResponse out,
      CallUnary(
          connection_, *stub_, &v1::PoseGraph::Stub::LookupPose, call, Repeat::kOnTrouble, in));
  return FromProto(out);
}

absl::StatusOr<LocalizeResult> RemotePoseGraph::Localize(const api::Call& call,
                                                         absl::string_view map,
                                                         const LocalizeQuery& query) {
  STRATA_RETURN_IF_ERROR(ValidateLocalizeQuery(query));
  Backoff backoff = connection_.NewBackoff();
  Route<v1::PoseGraph::Stub> route(connection_, *stub_);
  while (true) {
    const absl::StatusOr<v1::LocalizeResponse> out =
        SendQuery(connection_, route.stub(), call, map, query);
    if (out.ok()) return FromProto(*out);
    route.Follow(out.status(), backoff);
    if (!backoff.Wait(out.status(), call.stop)) return out.status();
  }
}

absl::StatusOr<std::unique_ptr<api::Tracking>> RemotePoseGraph::Track(const api::Call& call,
                                                                      absl::string_view map,
                                                                      const TrackStart& start) {
  STRATA_RETURN_IF_ERROR(ValidateTrackStart(start));
  Backoff backoff = connection_.NewBackoff();
  Route<v1::PoseGraph::Stub> route(connection_, *stub_);
  while (true) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    auto tracking = std::make_unique<RemoteTracking>(connection_, route.stub(), call);
    const absl::Status opened = tracking->Open(map, start);
    if (opened.ok()) return tracking;
    route.Follow(opened, backoff);
    if (!backoff.Wait(opened, call.stop)) return opened;
  }
}

}  // namespace strata::sdk
