#include "client/cli/terminal/world_json.h"

#include <string>
#include <utility>

#include "absl/strings/str_format.h"

#include "client/cli/terminal/json.h"

namespace strata::cli {

std::string ExtentOf(const MapStats& stats) {
  return absl::StrFormat("within (%.1f, %.1f, %.1f) and (%.1f, %.1f, %.1f)",
                         stats.box_min.x(),
                         stats.box_min.y(),
                         stats.box_min.z(),
                         stats.box_max.x(),
                         stats.box_max.y(),
                         stats.box_max.z());
}

std::string ToString(ConstraintOrigin origin) {
  switch (origin) {
    case ConstraintOrigin::kIngest:
      return "ingest";
    case ConstraintOrigin::kPerson:
      return "person";
    case ConstraintOrigin::kOptimize:
      return "optimize";
  }
  return "unknown";
}

std::string ToString(PlaneKind kind) {
  switch (kind) {
    case PlaneKind::kWall:
      return "wall";
    case PlaneKind::kLevel:
      return "level";
    case PlaneKind::kSloped:
      return "sloped";
  }
  return "unknown";
}

Json ToJson(const EpochInfo& epoch) {
  return {{"epoch", epoch.epoch},
          {"created", TimeText(epoch.created)},
          {"reason", epoch.reason},
          {"job", epoch.job == 0 ? Json() : Json(epoch.job)},
          {"decided", epoch.decided},
          {"current", epoch.current},
          {"kept", epoch.kept}};
}

Json ToJson(const api::ScanChange& scan) {
  if (scan.gone) return {{"id", scan.id.ToString()}, {"gone", true}};
  return {{"id", scan.id.ToString()},
          {"state", ToString(scan.state)},
          {"pose", ToJson(scan.T_map_scan)},
          {"gone", false}};
}

Json ToJson(const api::TileChangeNotice& tile) {
  return {{"key", tile.key.ToString()}, {"version", tile.version}, {"gone", tile.gone}};
}

Json ToJson(const api::MapUpdate& update) {
  Json scans = Json::array();
  for (const api::ScanChange& scan : update.scans) scans.push_back(ToJson(scan));
  Json tiles = Json::array();
  for (const api::TileChangeNotice& tile : update.tiles) tiles.push_back(ToJson(tile));
  return {{"whole", update.whole},
          {"commit_sequence", update.commit_sequence},
          {"epoch", update.epoch},
          {"epoch_reason", update.epoch_reason},
          {"scans", scans},
          {"tiles", tiles},
          {"inferred", update.inferred}};
}

Json ToJson(const Matrix6d& matrix) {
  Json rows = Json::array();
  for (int r = 0; r < 6; ++r) {
    Json row = Json::array();
    for (int c = 0; c < 6; ++c) row.push_back(matrix(r, c));
    rows.push_back(row);
  }
  return rows;
}

Json ToJson(const Constraint& constraint) {
  return {{"id", constraint.id},
          {"kind", constraint.is_prior() ? "prior" : "relative"},
          {"i", constraint.is_prior() ? Json() : Json(constraint.i.ToString())},
          {"j", constraint.j.ToString()},
          {"origin", ToString(constraint.origin)},
          {"enabled", constraint.enabled},
          {"may_be_false", constraint.may_be_false},
          {"pose", ToJson(constraint.T_i_j)},
          {"information", ToJson(constraint.information)},
          {"note", constraint.note}};
}

Json ToJson(const GlobalPlane& plane) {
  Json supports = Json::array();
  double weight = 0.0;
  for (const PlaneSupport& support : plane.supports) {
    supports.push_back(
        {{"scan", support.scan.ToString()}, {"weight", support.weight}, {"rms_m", support.rms_m}});
    weight += support.weight;
  }
  return {{"id", plane.id},
          {"kind", ToString(plane.kind)},
          {"normal", ToJson(plane.plane.normal)},
          {"distance_m", plane.plane.distance},
          {"from", plane.from_edges ? "edges" : "surfaces"},
          {"supporters", plane.supports.size()},
          {"weight", weight},
          {"enabled", plane.enabled},
          {"note", plane.note},
          {"supports", supports}};
}

Json ToJson(const ModelPlane& plane) {
  const auto ring = [](const PlaneRing& points) {
    Json json = Json::array();
    for (const Eigen::Vector3d& p : points) json.push_back(ToJson(p));
    return json;
  };
  Json polygons = Json::array();
  for (const PlanePolygon& polygon : plane.polygons) {
    Json holes = Json::array();
    for (const PlaneHole& hole : polygon.holes) {
      holes.push_back({{"ring", ring(hole.ring)}, {"seen_open", hole.seen_open}});
    }
    polygons.push_back(
        {{"area_m2", polygon.area_m2}, {"outer", ring(polygon.outer)}, {"holes", holes}});
  }
  return {{"id", plane.id},
          {"kind", ToString(plane.kind)},
          {"normal", ToJson(plane.plane.normal)},
          {"distance_m", plane.plane.distance},
          {"direction", plane.direction == kNoDirection ? Json() : Json(plane.direction)},
          {"area_m2", plane.area_m2},
          {"points", plane.point_count},
          {"rms_m", plane.rms_m},
          {"sigma_m", plane.sigma_m},
          {"sigma_rad", plane.sigma_rad},
          {"colour", plane.colour.has_value() ? ToJson(*plane.colour) : Json()},
          {"polygons", polygons}};
}

Json ToJson(const PlaneModelInfo& info) {
  Json directions = Json::array();
  for (const MainDirection& one : info.directions) {
    directions.push_back({{"direction", ToJson(one.direction)},
                          {"planes", one.planes},
                          {"sigma_rad", one.sigma_rad}});
  }
  return {{"job", info.job},
          {"epoch", info.epoch},
          {"made", TimeText(info.made)},
          {"scans", info.scans},
          {"points", info.points},
          {"planes", info.planes},
          {"directions", directions}};
}

Json ToJson(const api::PoseLookup& lookup) {
  return {{"known", lookup.known},
          {"message", lookup.message},
          {"pose", ToJson(lookup.T_map_scan)},
          {"epoch", lookup.epoch}};
}

Json ToJson(const LocalizeCandidate& candidate) {
  return {{"place", candidate.place.ToString()},
          {"pose", ToJson(candidate.T_map_scan)},
          {"confidence", candidate.confidence},
          {"overlap", candidate.overlap},
          {"rms_m", candidate.rms_m}};
}

Json ToJson(const LocalizeResult& result) {
  Json json = {{"found", result.found}, {"message", result.message}, {"epoch", result.epoch}};
  if (result.found) {
    json.update(ToJson(result.best));
    json["covariance"] = ToJson(result.covariance);
  }
  Json others = Json::array();
  for (const LocalizeCandidate& other : result.others) others.push_back(ToJson(other));
  json["others"] = others;
  return json;
}

Json ToJson(const TrackedPose& pose) {
  Json json = {{"state", std::string(ToString(pose.state))},
               {"score", pose.score},
               {"overlap", pose.overlap},
               {"contradiction", pose.contradiction},
               {"rms_m", pose.rms_m},
               {"found", pose.found},
               {"epoch", pose.epoch},
               {"message", pose.message}};
  if (pose.known) {
    json["pose"] = ToJson(pose.T_map_scan);
    json["covariance"] = ToJson(pose.covariance);
  }
  return json;
}

Json ToJson(const ExploreResult& result) {
  Json views = Json::array();
  for (const ExploreView& view : result.views) {
    views.push_back({{"pose", ToJson(view.T_map_sensor)},
                     {"place", ToJson(view.place)},
                     {"gain_bits", view.gain_bits},
                     {"volume_m3", view.volume_m3},
                     {"cost_m", view.cost_m},
                     {"utility_bits", view.utility_bits}});
  }
  Json json = {{"reason", std::string(ToString(result.reason))},
               {"message", result.message},
               {"views", std::move(views)},
               {"stands", result.stands},
               {"known_m3", result.known_m3},
               {"region_m3", result.region_m3},
               {"scans", result.scans},
               {"scans_left_out", result.scans_left_out},
               {"elapsed_ms", result.elapsed_ms},
               {"epoch", result.epoch}};
  if (!result.region.isEmpty()) {
    json["region"] = {ToJson(Eigen::Vector3d(result.region.min())),
                      ToJson(Eigen::Vector3d(result.region.max()))};
  }
  if (result.nearest.has_value()) json["nearest"] = ToJson(*result.nearest);
  return json;
}

}  // namespace strata::cli
