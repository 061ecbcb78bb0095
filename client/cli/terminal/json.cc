#include "client/cli/terminal/json.h"

#include <cmath>
#include <string>

#include "absl/strings/str_format.h"
#include "absl/time/civil_time.h"
#include "absl/time/time.h"
#include <Eigen/Geometry>

namespace strata::cli {
namespace {

// A float without the digits that only its conversion to double adds.
double Short(float value) { return std::round(static_cast<double>(value) * 1e6) / 1e6; }

double Seconds(absl::Time time) { return static_cast<double>(absl::ToUnixMicros(time)) * 1e-6; }

// No lidar scanned in 1970: files without times have 0, and some clocks begin with the robot.
bool HasDate(absl::Time time) {
  return time >= absl::FromCivil(absl::CivilDay(1971), absl::UTCTimeZone());
}

Json Alignment(const AlignmentReport& report) {
  return {{"aligned", report.aligned},
          {"message", report.message},
          {"overlap", report.overlap},
          {"rms_m", report.rms_m},
          {"iterations", report.iterations}};
}

}  // namespace

std::string TimeText(absl::Time time) {
  return absl::FormatTime("%Y-%m-%dT%H:%M:%E6SZ", time, absl::UTCTimeZone());
}

std::string ToString(ScanState state) {
  switch (state) {
    case ScanState::kPending:
      return "pending";
    case ScanState::kIntegrated:
      return "integrated";
    case ScanState::kFailed:
      return "failed";
  }
  return "unknown";
}

std::string ToString(Traversability traversability) {
  switch (traversability) {
    case Traversability::kUnknown:
      return "unknown";
    case Traversability::kTraversable:
      return "traversable";
    case Traversability::kNonTraversable:
      return "non_traversable";
    case Traversability::kUnderside:
      return "underside";
  }
  return "unknown";
}

Json ToJson(const Eigen::Vector3d& point) { return {point.x(), point.y(), point.z()}; }

Json ToJson(const Pose& pose) {
  const Eigen::Quaterniond q(pose.linear());
  const Eigen::Vector3d t = pose.translation();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

Json ToJson(const RobotProfile& profile) {
  return {{"radius_m", profile.radius_m},
          {"height_m", profile.height_m},
          {"max_step_m", profile.max_step_m},
          {"max_slope_rad", profile.max_slope_rad},
          {"max_gap_m", profile.max_gap_m},
          {"max_roughness_m", profile.max_roughness_m}};
}

Json ToJson(const MapInfo& info) {
  const MapParameters& parameters = info.parameters;
  Json json = {{"name", info.name},
               {"created", TimeText(info.created)},
               {"cell_size_m", parameters.mls.cell_size_m},
               {"gap_size_m", parameters.mls.gap_size_m},
               {"thickness_m", parameters.mls.thickness_m},
               {"keep_points", parameters.keep_points},
               {"fade_after", parameters.fade_after},
               {"sensor",
                {{"sigma_m", parameters.sensor.sigma_m},
                 {"sigma_per_metre", parameters.sensor.sigma_per_metre},
                 {"min_range_m", parameters.sensor.min_range_m},
                 {"max_range_m", parameters.sensor.max_range_m}}},
               {"default_profile", ToJson(parameters.default_profile)}};
  if (parameters.origin.has_value()) {
    json["origin"] = {{"latitude_rad", parameters.origin->latitude_rad},
                      {"longitude_rad", parameters.origin->longitude_rad},
                      {"altitude_m", parameters.origin->altitude_m}};
  }
  return json;
}

Json ToJson(const ClassifierInfo& classifier) {
  return {{"id", classifier.id},
          {"name", classifier.name},
          {"created", TimeText(classifier.created)},
          {"job", classifier.job},
          {"description", classifier.description},
          {"parameters", classifier.parameters},
          {"scores", classifier.scores},
          {"bytes", classifier.bytes}};
}

Json ToJson(const Colour& colour) { return absl::StrFormat("#%06x", PackedRgb(colour)); }

Json ToJson(const MapClass& map_class) {
  return {{"id", map_class.id}, {"name", map_class.name}, {"colour", ToJson(map_class.colour)}};
}

Json ToJson(const MapInfo& info, const MapStats& stats) {
  Json json = ToJson(info);
  json["scans"] = stats.scans;
  json["scans_pending"] = stats.scans_pending;
  json["scans_failed"] = stats.scans_failed;
  json["points"] = stats.points;
  json["patches"] = stats.patches;
  json["occupied_cells"] = stats.occupied_cells;
  json["tiles"] = stats.tiles;
  json["tiles_prepared"] = stats.tiles_prepared;
  json["tile_bytes"] = stats.tile_bytes;
  json["point_bytes"] = stats.point_bytes;
  json["epoch"] = stats.epoch;
  json["commit_sequence"] = stats.commit_sequence;
  json["surface_spread_m"] = stats.surface_spread_m;
  json["content_digest"] = stats.content_digest;
  json["box_min"] = ToJson(stats.box_min);
  json["box_max"] = ToJson(stats.box_max);
  return json;
}

Json ToJson(const ScanInfo& info) {
  const ScanHeader& header = info.header;
  return {{"id", header.id.ToString()},
          {"trajectory", header.id.trajectory},
          {"sequence", header.id.sequence},
          {"time", HasDate(header.time) ? Json(TimeText(header.time)) : Json()},
          {"time_s", Seconds(header.time)},
          {"state", ToString(info.state)},
          {"message", info.message},
          {"points", header.point_count},
          {"rows", header.rows},
          {"columns", header.columns},
          {"has_intensity", header.has_intensity},
          {"has_colour", header.has_colour},
          {"has_label", header.has_label},
          {"person_labels", info.person_labels},
          {"label_model", info.label_model},
          {"faded_points", info.faded_points},
          {"point_bytes", info.point_bytes},
          {"commit_sequence", info.commit_sequence},
          {"content_hash", info.content_hash},
          {"pose_uploaded", ToJson(header.T_map_scan)},
          {"pose", ToJson(info.T_map_scan)},
          {"alignment", Alignment(info.alignment)}};
}

Json ToJson(const PoseNode& node) {
  const Pose correction = node.T_map_scan_uploaded.inverse() * node.T_map_scan;
  return {{"id", node.id.ToString()},
          {"time_s", Seconds(node.time)},
          {"state", ToString(node.state)},
          {"pose", ToJson(node.T_map_scan)},
          {"pose_uploaded", ToJson(node.T_map_scan_uploaded)},
          {"correction_m", correction.translation().norm()},
          {"correction_rad", RotationAngleRad(correction)}};
}

Json ToJson(const JobInfo& job) {
  Json parameters = Json::object();
  for (const auto& [key, value] : job.parameters) parameters[key] = value;
  Json metrics = Json::object();
  for (const auto& [key, value] : job.metrics) metrics[key] = value;
  return {{"id", job.id},
          {"kind", job.kind},
          {"parameters", parameters},
          {"state", std::string(ToString(job.state))},
          {"progress", job.progress},
          {"phase", job.phase},
          {"message", job.message},
          {"metrics", metrics},
          {"created", TimeText(job.created)},
          {"updated", TimeText(job.updated)}};
}

Json ToJson(const PlanResult& plan) {
  Json waypoints = Json::array();
  for (const Eigen::Vector3d& waypoint : plan.waypoints) waypoints.push_back(ToJson(waypoint));
  Json gaps = Json::array();
  for (const PlanGap& gap : plan.gaps) {
    gaps.push_back(
        {{"from", ToJson(gap.from)}, {"to", ToJson(gap.to)}, {"length_m", gap.length_m}});
  }
  Json tiles = Json::array();
  for (const TileKey& tile : plan.tiles) tiles.push_back(tile.ToString());
  Json json = {{"found", plan.found()},
               {"reason", std::string(strata::ToString(plan.reason))},
               {"message", plan.message},
               {"length_m", plan.length_m},
               {"cost", plan.cost},
               {"waypoints", waypoints},
               {"expanded", plan.expanded},
               {"elapsed_ms", plan.elapsed_ms},
               {"epoch", plan.epoch},
               {"gaps", gaps},
               {"tiles", tiles}};
  if (plan.obstruction != Obstruction::kNone) {
    json["obstruction"] = std::string(strata::ToString(plan.obstruction));
    json["obstruction_value"] = plan.obstruction_value;
    json["inferred"] = plan.inferred;
  }
  if (plan.where.has_value()) json["where"] = ToJson(*plan.where);
  if (plan.nearest.has_value()) json["nearest"] = ToJson(*plan.nearest);
  return json;
}

Json ToJson(const PathCheck& check) {
  Json tiles = Json::array();
  for (const TileKey& tile : check.tiles) tiles.push_back(tile.ToString());
  Json json = {{"valid", check.valid},
               {"message", check.message},
               {"valid_m", check.valid_m},
               {"length_m", check.length_m},
               {"epoch", check.epoch},
               {"commit_sequence", check.commit_sequence},
               {"tiles", tiles}};
  if (check.obstruction != Obstruction::kNone) {
    json["obstruction"] = std::string(strata::ToString(check.obstruction));
    json["obstruction_value"] = check.obstruction_value;
    json["inferred"] = check.inferred;
  }
  if (check.where.has_value()) json["where"] = ToJson(*check.where);
  return json;
}

Json ToJson(const Surface& surface) {
  return {{"z", Short(surface.z_m)},
          {"sigma_m", Short(surface.sigma_m)},
          {"depth_m", Short(surface.depth_m)},
          {"vertical", surface.vertical()},
          {"traversability", ToString(surface.traversability)},
          {"class", surface.class_id},
          {"confidence", surface.class_id == 0 ? Json() : Json(surface.confidence / 100.0)},
          {"colour", surface.coloured() ? ToJson(surface.colour) : Json()},
          {"cost", Short(surface.cost)}};
}

Json ToJson(const SurfaceColumn& column) {
  Json surfaces = Json::array();
  for (const Surface& surface : column.surfaces) {
    Json json = ToJson(surface);
    json["level"] = surfaces.size();
    surfaces.push_back(json);
  }
  return {{"x", column.x_m}, {"y", column.y_m}, {"surfaces", surfaces}};
}

Json ToJson(const api::TileInfo& tile) {
  return {{"key", tile.key.ToString()},
          {"level", tile.key.level},
          {"x", tile.key.x},
          {"y", tile.key.y},
          {"version", tile.version},
          {"patches", tile.patches},
          {"bytes", tile.bytes}};
}

}  // namespace strata::cli
