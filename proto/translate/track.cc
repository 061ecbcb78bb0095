#include "proto/translate/track.h"

#include <string>

#include "absl/status/status.h"

#include "core/common/status.h"
#include "proto/translate/geometry.h"
#include "proto/translate/maps.h"
#include "proto/translate/points.h"

namespace strata::translate {
namespace {

v1::TrackState StateToProto(TrackState state) {
  switch (state) {
    case TrackState::kTracked:
      return v1::TRACK_STATE_TRACKED;
    case TrackState::kPredicted:
      return v1::TRACK_STATE_PREDICTED;
    case TrackState::kLost:
      return v1::TRACK_STATE_LOST;
  }
  return v1::TRACK_STATE_UNSPECIFIED;
}

absl::StatusOr<TrackState> StateFromProto(v1::TrackState state) {
  switch (state) {
    case v1::TRACK_STATE_TRACKED:
      return TrackState::kTracked;
    case v1::TRACK_STATE_PREDICTED:
      return TrackState::kPredicted;
    case v1::TRACK_STATE_LOST:
      return TrackState::kLost;
    default:
      return absl::InvalidArgumentError("the answer to a step has no state that is known");
  }
}

}  // namespace

v1::TrackStart ToProto(absl::string_view map, const TrackStart& start) {
  v1::TrackStart proto;
  proto.set_map(std::string(map));
  if (start.sensor.has_value()) *proto.mutable_sensor() = ToProto(*start.sensor);
  if (start.T_map_scan_guess.has_value()) {
    *proto.mutable_guess() = ToProto(*start.T_map_scan_guess);
  }
  proto.set_guess_radius_m(start.guess_radius_m);
  return proto;
}

absl::StatusOr<TrackStart> FromProto(const v1::TrackStart& proto) {
  TrackStart start;
  if (proto.has_sensor()) start.sensor = FromProto(proto.sensor());
  if (proto.has_guess()) {
    STRATA_ASSIGN_OR_RETURN(start.T_map_scan_guess, FromProto("guess", proto.guess()));
  }
  if (proto.has_guess_radius_m()) start.guess_radius_m = proto.guess_radius_m();
  STRATA_RETURN_IF_ERROR(ValidateTrackStart(start));
  return start;
}

v1::TrackStep ToProto(const TrackStep& step) {
  v1::TrackStep proto;
  *proto.mutable_odometry() = ToProto(step.T_odom_scan);
  if (step.motion_covariance.has_value()) {
    *proto.mutable_motion_covariance() = ToProto(*step.motion_covariance);
  }
  proto.set_point_count(step.cloud.size());
  proto.set_rows(step.cloud.rows);
  proto.set_columns(step.cloud.columns);
  *proto.mutable_sensor_origin() =
      ToProto(Eigen::Vector3d(step.cloud.sensor_origin.cast<double>()));
  return proto;
}

absl::StatusOr<TrackStep> FromProto(const v1::TrackStep& proto) {
  TrackStep step;
  STRATA_ASSIGN_OR_RETURN(step.T_odom_scan, FromProto("odometry", proto.odometry()));
  if (!proto.motion_covariance().empty()) {
    STRATA_ASSIGN_OR_RETURN(step.motion_covariance,
                            FromProto("motion_covariance", proto.motion_covariance()));
  }
  STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d sensor_origin,
                          FromProto("sensor_origin", proto.sensor_origin()));
  step.cloud.sensor_origin = sensor_origin.cast<float>();
  STRATA_RETURN_IF_ERROR(ValidateTrackMotion(step));
  STRATA_RETURN_IF_ERROR(CheckGrid(proto.rows(), proto.columns(), proto.point_count()));
  return step;
}

v1::TrackResponse ToProto(const TrackedPose& pose) {
  v1::TrackResponse proto;
  proto.set_state(StateToProto(pose.state));
  proto.set_known(pose.known);
  *proto.mutable_pose() = ToProto(pose.T_map_scan);
  *proto.mutable_covariance() = ToProto(pose.covariance);
  proto.set_score(pose.score);
  proto.set_overlap(pose.overlap);
  proto.set_contradiction(pose.contradiction);
  proto.set_rms_m(pose.rms_m);
  proto.set_found(pose.found);
  proto.set_epoch(pose.epoch);
  proto.set_message(pose.message);
  return proto;
}

absl::StatusOr<TrackedPose> FromProto(const v1::TrackResponse& proto) {
  TrackedPose pose;
  STRATA_ASSIGN_OR_RETURN(pose.state, StateFromProto(proto.state()));
  pose.known = proto.known();
  STRATA_ASSIGN_OR_RETURN(pose.T_map_scan, FromProto("pose", proto.pose()));
  STRATA_ASSIGN_OR_RETURN(pose.covariance, FromProto("covariance", proto.covariance()));
  pose.score = proto.score();
  pose.overlap = proto.overlap();
  pose.contradiction = proto.contradiction();
  pose.rms_m = proto.rms_m();
  pose.found = proto.found();
  pose.epoch = proto.epoch();
  pose.message = proto.message();
  return pose;
}

}  // namespace strata::translate
