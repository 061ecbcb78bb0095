#include "proto/translate/scans.h"

#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "proto/translate/geometry.h"
#include "proto/translate/maps.h"

namespace strata::translate {
namespace {

static_assert(v1::SCAN_STATE_PENDING == static_cast<int>(ScanState::kPending));
static_assert(v1::SCAN_STATE_INTEGRATED == static_cast<int>(ScanState::kIntegrated));
static_assert(v1::SCAN_STATE_FAILED == static_cast<int>(ScanState::kFailed));

absl::StatusOr<Alignment> AlignmentFromProto(v1::Alignment alignment) {
  switch (alignment) {
    case v1::ALIGNMENT_UNSPECIFIED:
    case v1::ALIGNMENT_ON:
      return Alignment::kOn;
    case v1::ALIGNMENT_OFF:
      return Alignment::kOff;
    default:
      return absl::InvalidArgumentError(
          absl::StrCat("alignment: ", static_cast<int>(alignment), " is neither on nor off"));
  }
}

v1::AlignmentReport ReportToProto(const AlignmentReport& report) {
  v1::AlignmentReport proto;
  proto.set_aligned(report.aligned);
  proto.set_message(report.message);
  proto.set_overlap(report.overlap);
  proto.set_rms_m(report.rms_m);
  proto.set_iterations(report.iterations);
  return proto;
}

AlignmentReport ReportFromProto(const v1::AlignmentReport& proto) {
  return {.aligned = proto.aligned(),
          .message = proto.message(),
          .overlap = proto.overlap(),
          .rms_m = proto.rms_m(),
          .iterations = proto.iterations()};
}

}  // namespace

v1::ScanId ToProto(const ScanId& id) {
  v1::ScanId proto;
  proto.set_trajectory(id.trajectory);
  proto.set_sequence(id.sequence);
  return proto;
}

ScanId FromProto(const v1::ScanId& id) { return {id.trajectory(), id.sequence()}; }

v1::ScanState ToProto(ScanState state) { return static_cast<v1::ScanState>(state); }

absl::StatusOr<ScanState> FromProto(v1::ScanState state) {
  if (v1::ScanState_IsValid(state) && state != v1::SCAN_STATE_UNSPECIFIED) {
    return static_cast<ScanState>(state);
  }
  return absl::InvalidArgumentError(
      absl::StrCat("state: ", static_cast<int>(state), " is not a state of a scan"));
}

v1::ScanHeader ToProto(const ScanHeader& header) {
  v1::ScanHeader proto;
  *proto.mutable_id() = ToProto(header.id);
  *proto.mutable_time() = ToProto(header.time);
  *proto.mutable_pose() = ToProto(header.T_map_scan);
  *proto.mutable_sensor_origin() = ToProto(Eigen::Vector3d(header.sensor_origin.cast<double>()));
  if (header.sensor.has_value()) *proto.mutable_sensor() = ToProto(*header.sensor);
  proto.set_alignment(header.alignment == Alignment::kOn ? v1::ALIGNMENT_ON : v1::ALIGNMENT_OFF);
  proto.set_point_count(header.point_count);
  proto.set_rows(header.rows);
  proto.set_columns(header.columns);
  proto.set_has_intensity(header.has_intensity);
  proto.set_has_colour(header.has_colour);
  proto.set_has_label(header.has_label);
  proto.set_content_hash(header.content_hash);
  return proto;
}

absl::StatusOr<ScanHeader> FromProto(const v1::ScanHeader& proto) {
  ScanHeader header;
  header.id = FromProto(proto.id());
  STRATA_ASSIGN_OR_RETURN(header.time, FromProto("time", proto.time()));
  STRATA_ASSIGN_OR_RETURN(header.T_map_scan, FromProto("pose", proto.pose()));
  STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d sensor_origin,
                          FromProto("sensor_origin", proto.sensor_origin()));
  header.sensor_origin = sensor_origin.cast<float>();
  if (proto.has_sensor()) header.sensor = FromProto(proto.sensor());
  STRATA_ASSIGN_OR_RETURN(header.alignment, AlignmentFromProto(proto.alignment()));
  header.point_count = proto.point_count();
  header.rows = proto.rows();
  header.columns = proto.columns();
  header.has_intensity = proto.has_intensity();
  header.has_colour = proto.has_colour();
  header.has_label = proto.has_label();
  header.content_hash = proto.content_hash();
  STRATA_RETURN_IF_ERROR(ValidateScanHeader(header));
  return header;
}

v1::ScanInfo ToProto(const ScanInfo& scan) {
  v1::ScanInfo proto;
  *proto.mutable_header() = ToProto(scan.header);
  proto.set_state(ToProto(scan.state));
  *proto.mutable_pose() = ToProto(scan.T_map_scan);
  proto.set_commit_sequence(scan.commit_sequence);
  proto.set_point_bytes(scan.point_bytes);
  proto.set_content_hash(scan.content_hash);
  proto.set_message(scan.message);
  *proto.mutable_alignment() = ReportToProto(scan.alignment);
  proto.set_person_labels(scan.person_labels);
  proto.set_label_model(scan.label_model);
  proto.set_faded_points(scan.faded_points);
  return proto;
}

absl::StatusOr<ScanInfo> FromProto(const v1::ScanInfo& proto) {
  ScanInfo scan;
  STRATA_ASSIGN_OR_RETURN(scan.header, FromProto(proto.header()));
  STRATA_ASSIGN_OR_RETURN(scan.state, FromProto(proto.state()));
  STRATA_ASSIGN_OR_RETURN(scan.T_map_scan, FromProto("pose", proto.pose()));
  scan.commit_sequence = proto.commit_sequence();
  scan.point_bytes = proto.point_bytes();
  scan.content_hash = proto.content_hash();
  scan.message = proto.message();
  scan.alignment = ReportFromProto(proto.alignment());
  scan.person_labels = proto.person_labels();
  scan.label_model = proto.label_model();
  scan.faded_points = proto.faded_points();
  return scan;
}

v1::ScanAck ToProto(const ScanAck& ack) {
  v1::ScanAck proto;
  *proto.mutable_id() = ToProto(ack.id);
  proto.set_commit_sequence(ack.commit_sequence);
  proto.set_already_present(ack.already_present);
  proto.set_content_hash(ack.content_hash);
  return proto;
}

ScanAck FromProto(const v1::ScanAck& proto) {
  return {.id = FromProto(proto.id()),
          .commit_sequence = proto.commit_sequence(),
          .already_present = proto.already_present(),
          .content_hash = proto.content_hash()};
}

v1::GetUploadStateResponse ToProto(const UploadState& state) {
  v1::GetUploadStateResponse proto;
  proto.set_exists(state.exists);
  proto.set_last_sequence(state.last_sequence);
  proto.set_scans(state.scans);
  return proto;
}

UploadState FromProto(const v1::GetUploadStateResponse& proto) {
  return {.exists = proto.exists(), .last_sequence = proto.last_sequence(), .scans = proto.scans()};
}

v1::ListScansRequest ToProto(absl::string_view map, const api::ScanFilter& filter) {
  v1::ListScansRequest proto;
  proto.set_map(std::string(map));
  if (filter.trajectory.has_value()) proto.set_trajectory(*filter.trajectory);
  if (filter.state.has_value()) proto.set_state(ToProto(*filter.state));
  if (filter.from.has_value()) *proto.mutable_from() = ToProto(*filter.from);
  if (filter.until.has_value()) *proto.mutable_until() = ToProto(*filter.until);
  if (filter.box.has_value()) *proto.mutable_box() = ToProto(*filter.box);
  return proto;
}

absl::StatusOr<api::ScanFilter> FromProto(const v1::ListScansRequest& proto) {
  api::ScanFilter filter;
  if (proto.has_trajectory()) filter.trajectory = proto.trajectory();
  if (proto.state() != v1::SCAN_STATE_UNSPECIFIED) {
    STRATA_ASSIGN_OR_RETURN(filter.state, FromProto(proto.state()));
  }
  if (proto.has_from()) {
    STRATA_ASSIGN_OR_RETURN(filter.from, FromProto("from", proto.from()));
  }
  if (proto.has_until()) {
    STRATA_ASSIGN_OR_RETURN(filter.until, FromProto("until", proto.until()));
  }
  if (proto.has_box()) {
    STRATA_ASSIGN_OR_RETURN(filter.box, FromProto("box", proto.box()));
  }
  return filter;
}

}  // namespace strata::translate
