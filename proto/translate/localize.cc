#include "proto/translate/localize.h"

#include <string>
#include <utility>

#include "absl/status/status.h"

#include "core/common/status.h"
#include "proto/translate/geometry.h"
#include "proto/translate/maps.h"
#include "proto/translate/points.h"
#include "proto/translate/scans.h"

namespace strata::translate {
namespace {

v1::LocalizeCandidate CandidateToProto(const LocalizeCandidate& candidate) {
  v1::LocalizeCandidate proto;
  *proto.mutable_pose() = ToProto(candidate.T_map_scan);
  *proto.mutable_place() = ToProto(candidate.place);
  proto.set_overlap(candidate.overlap);
  proto.set_rms_m(candidate.rms_m);
  proto.set_confidence(candidate.confidence);
  return proto;
}

absl::StatusOr<LocalizeCandidate> CandidateFromProto(const v1::LocalizeCandidate& proto) {
  LocalizeCandidate candidate;
  STRATA_ASSIGN_OR_RETURN(candidate.T_map_scan, FromProto("pose", proto.pose()));
  candidate.place = FromProto(proto.place());
  candidate.overlap = proto.overlap();
  candidate.rms_m = proto.rms_m();
  candidate.confidence = proto.confidence();
  return candidate;
}

}  // namespace

v1::LocalizeStart ToProto(absl::string_view map, const LocalizeQuery& query) {
  v1::LocalizeStart proto;
  proto.set_map(std::string(map));
  proto.set_point_count(query.cloud.size());
  proto.set_rows(query.cloud.rows);
  proto.set_columns(query.cloud.columns);
  *proto.mutable_sensor_origin() =
      ToProto(Eigen::Vector3d(query.cloud.sensor_origin.cast<double>()));
  if (query.sensor.has_value()) *proto.mutable_sensor() = ToProto(*query.sensor);
  if (query.T_map_scan_guess.has_value()) {
    *proto.mutable_guess() = ToProto(*query.T_map_scan_guess);
  }
  proto.set_guess_radius_m(query.guess_radius_m);
  return proto;
}

absl::StatusOr<LocalizeQuery> FromProto(const v1::LocalizeStart& proto) {
  LocalizeQuery query;
  query.cloud.rows = proto.rows();
  query.cloud.columns = proto.columns();
  STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d sensor_origin,
                          FromProto("sensor_origin", proto.sensor_origin()));
  query.cloud.sensor_origin = sensor_origin.cast<float>();
  if (proto.has_sensor()) query.sensor = FromProto(proto.sensor());
  if (proto.has_guess()) {
    STRATA_ASSIGN_OR_RETURN(query.T_map_scan_guess, FromProto("guess", proto.guess()));
  }
  if (proto.has_guess_radius_m()) query.guess_radius_m = proto.guess_radius_m();
  STRATA_RETURN_IF_ERROR(ValidateLocalizeGuess(query));
  STRATA_RETURN_IF_ERROR(CheckGrid(proto.rows(), proto.columns(), proto.point_count()));
  return query;
}

v1::LocalizeResponse ToProto(const LocalizeResult& result) {
  v1::LocalizeResponse proto;
  proto.set_found(result.found);
  proto.set_message(result.message);
  *proto.mutable_best() = CandidateToProto(result.best);
  *proto.mutable_covariance() = ToProto(result.covariance);
  for (const LocalizeCandidate& other : result.others) {
    *proto.add_others() = CandidateToProto(other);
  }
  proto.set_epoch(result.epoch);
  return proto;
}

absl::StatusOr<LocalizeResult> FromProto(const v1::LocalizeResponse& proto) {
  LocalizeResult result;
  result.found = proto.found();
  result.message = proto.message();
  STRATA_ASSIGN_OR_RETURN(result.best, CandidateFromProto(proto.best()));
  STRATA_ASSIGN_OR_RETURN(result.covariance, FromProto("covariance", proto.covariance()));
  for (const v1::LocalizeCandidate& other : proto.others()) {
    STRATA_ASSIGN_OR_RETURN(LocalizeCandidate added, CandidateFromProto(other));
    result.others.push_back(std::move(added));
  }
  result.epoch = proto.epoch();
  return result;
}

}  // namespace strata::translate
