#include "proto/translate/planning.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "proto/translate/geometry.h"
#include "proto/translate/maps.h"
#include "proto/translate/tiles.h"

namespace strata::translate {
namespace {

// PlanReason and its wire twin differ by the wire's UNSPECIFIED.
constexpr int kReasonOffset = 1;
static_assert(v1::PLAN_REASON_FOUND == static_cast<int>(PlanReason::kFound) + kReasonOffset);
static_assert(v1::PLAN_REASON_SEARCH_LIMIT ==
              static_cast<int>(PlanReason::kSearchLimit) + kReasonOffset);
static_assert(v1::OBSTRUCTION_STEP == static_cast<int>(Obstruction::kStep));
static_assert(v1::OBSTRUCTION_UNKNOWN == static_cast<int>(Obstruction::kUnknown));
static_assert(v1::OBSTRUCTION_CLASS == static_cast<int>(Obstruction::kClass));
static_assert(v1::TRAVERSABILITY_TRAVERSABLE == static_cast<int>(Traversability::kTraversable));
static_assert(v1::TRAVERSABILITY_NON_TRAVERSABLE ==
              static_cast<int>(Traversability::kNonTraversable));
static_assert(v1::TRAVERSABILITY_UNDERSIDE == static_cast<int>(Traversability::kUnderside));

using ClassCostFields = google::protobuf::RepeatedPtrField<v1::ClassCost>;

absl::StatusOr<ClassCosts> ClassCostsFromProto(const ClassCostFields& fields) {
  constexpr std::uint32_t kMostId = 255;
  ClassCosts costs;
  for (const v1::ClassCost& cost : fields) {
    const double factor = cost.forbidden() ? kForbiddenClass : cost.factor();
    // A larger id is refused as 256, which is none either.
    const auto id = static_cast<int>(std::min(cost.class_id(), kMostId + 1));
    if (!costs.emplace(id, factor).second) {
      return absl::InvalidArgumentError(
          absl::StrCat("class_costs: class ", cost.class_id(), " is there twice"));
    }
  }
  STRATA_RETURN_IF_ERROR(ValidateClassCosts(costs));
  return costs;
}

void ClassCostsToProto(const ClassCosts& costs, ClassCostFields& fields) {
  for (const auto& [id, factor] : costs) {
    v1::ClassCost& cost = *fields.Add();
    cost.set_class_id(static_cast<std::uint32_t>(id));
    if (factor == kForbiddenClass) {
      cost.set_forbidden(true);
    } else {
      cost.set_factor(factor);
    }
  }
}

// The fields that CheckPathRequest and WatchPathRequest share.
template <typename Request>
Request PathToProto(absl::string_view map, const PathQuery& query) {
  Request proto;
  proto.set_map(std::string(map));
  for (const Eigen::Vector3d& waypoint : query.waypoints) {
    *proto.add_waypoints() = ToProto(waypoint);
  }
  *proto.mutable_profile() = ToProto(query.profile);
  ClassCostsToProto(query.class_costs, *proto.mutable_class_costs());
  proto.set_inferred(ToProto(query.inferred));
  return proto;
}

template <typename Request>
absl::StatusOr<PathQuery> PathFromProto(const Request& proto) {
  PathQuery query;
  for (const v1::Vector3& waypoint : proto.waypoints()) {
    STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d p, FromProto("waypoint", waypoint));
    query.waypoints.push_back(p);
  }
  query.profile = FromProto(proto.profile());
  STRATA_RETURN_IF_ERROR(ValidateRobotProfile(query.profile));
  STRATA_ASSIGN_OR_RETURN(query.class_costs, ClassCostsFromProto(proto.class_costs()));
  STRATA_ASSIGN_OR_RETURN(query.inferred, FromProto(proto.inferred()));
  return query;
}

absl::StatusOr<std::optional<Eigen::Vector3d>> PlaceFromProto(const char* what,
                                                              bool present,
                                                              const v1::Vector3& place) {
  if (!present) return std::nullopt;
  STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d p, FromProto(what, place));
  return p;
}

v1::Surface SurfaceToProto(const Surface& surface) {
  v1::Surface proto;
  proto.set_cell(surface.cell);
  proto.set_traversability(static_cast<v1::Traversability>(surface.traversability));
  proto.set_class_id(surface.class_id);
  proto.set_z_m(surface.z_m);
  proto.set_sigma_m(surface.sigma_m);
  proto.set_depth_m(surface.depth_m);
  proto.set_cost(surface.cost);
  proto.set_confidence(surface.confidence);
  proto.set_colour(PackedRgb(surface.colour));
  return proto;
}

absl::StatusOr<Surface> SurfaceFromProto(const v1::Surface& proto) {
  if (proto.cell() > std::numeric_limits<std::uint16_t>::max() ||
      proto.class_id() > std::numeric_limits<std::uint8_t>::max() || proto.confidence() > 100 ||
      proto.colour() > 0xFFFFFF || !v1::Traversability_IsValid(proto.traversability())) {
    return absl::InvalidArgumentError(absl::StrCat("surface: cell ",
                                                   proto.cell(),
                                                   ", class_id ",
                                                   proto.class_id(),
                                                   ", confidence ",
                                                   proto.confidence(),
                                                   ", colour ",
                                                   proto.colour(),
                                                   " or traversability ",
                                                   static_cast<int>(proto.traversability()),
                                                   " is out of range"));
  }
  Surface surface;
  surface.cell = static_cast<std::uint16_t>(proto.cell());
  surface.traversability = static_cast<Traversability>(proto.traversability());
  surface.class_id = static_cast<std::uint8_t>(proto.class_id());
  surface.z_m = proto.z_m();
  surface.sigma_m = proto.sigma_m();
  surface.depth_m = proto.depth_m();
  surface.cost = proto.cost();
  surface.confidence = static_cast<std::uint8_t>(proto.confidence());
  surface.colour = ColourOfRgb(proto.colour());
  return surface;
}

absl::Status ReasonsFromProto(const v1::PlanPathResponse& proto, PlanResult& result) {
  if (!v1::PlanReason_IsValid(proto.reason()) || proto.reason() == v1::PLAN_REASON_UNSPECIFIED ||
      !v1::Obstruction_IsValid(proto.obstruction())) {
    return absl::InvalidArgumentError(absl::StrCat("plan: reason ",
                                                   static_cast<int>(proto.reason()),
                                                   " or obstruction ",
                                                   static_cast<int>(proto.obstruction()),
                                                   " is not known"));
  }
  result.reason = static_cast<PlanReason>(proto.reason() - kReasonOffset);
  result.obstruction = static_cast<Obstruction>(proto.obstruction());
  result.obstruction_value = proto.obstruction_value();
  result.inferred = proto.inferred();
  STRATA_ASSIGN_OR_RETURN(result.where, PlaceFromProto("where", proto.has_where(), proto.where()));
  STRATA_ASSIGN_OR_RETURN(result.nearest,
                          PlaceFromProto("nearest", proto.has_nearest(), proto.nearest()));
  return absl::OkStatus();
}

}  // namespace

v1::PlanEndpoint EndpointToProto(const PlanEndpoint& endpoint) {
  v1::PlanEndpoint proto;
  proto.set_x_m(endpoint.x_m);
  proto.set_y_m(endpoint.y_m);
  if (endpoint.level.has_value()) proto.set_level(*endpoint.level);
  if (endpoint.z_m.has_value()) proto.set_z_m(*endpoint.z_m);
  return proto;
}

absl::StatusOr<PlanEndpoint> EndpointFromProto(const char* what, const v1::PlanEndpoint& proto) {
  PlanEndpoint endpoint;
  endpoint.x_m = proto.x_m();
  endpoint.y_m = proto.y_m();
  if (proto.has_z_m()) endpoint.z_m = proto.z_m();
  if (proto.has_level()) endpoint.level = proto.level();
  const double z = endpoint.z_m.value_or(0.0);
  if (!std::isfinite(endpoint.x_m) || !std::isfinite(endpoint.y_m) || !std::isfinite(z)) {
    return absl::InvalidArgumentError(
        absl::StrCat(what, ": (", endpoint.x_m, ", ", endpoint.y_m, ", ", z, ") is not finite"));
  }
  if (endpoint.level.value_or(0) < 0) {
    return absl::InvalidArgumentError(
        absl::StrCat(what, ": level ", *endpoint.level, " is below 0"));
  }
  return endpoint;
}

v1::InferredAs ToProto(InferredAs as) {
  return as == InferredAs::kObstacle ? v1::INFERRED_AS_OBSTACLE : v1::INFERRED_AS_IGNORE;
}

absl::StatusOr<InferredAs> FromProto(v1::InferredAs as) {
  if (!v1::InferredAs_IsValid(as)) {
    return absl::InvalidArgumentError(
        absl::StrCat("inferred: unknown value ", static_cast<int>(as)));
  }
  return as == v1::INFERRED_AS_OBSTACLE ? InferredAs::kObstacle : InferredAs::kIgnore;
}

v1::PlanPathRequest ToProto(absl::string_view map, const PlanQuery& query) {
  v1::PlanPathRequest proto;
  proto.set_map(std::string(map));
  *proto.mutable_from() = EndpointToProto(query.from);
  *proto.mutable_to() = EndpointToProto(query.to);
  *proto.mutable_profile() = ToProto(query.profile);
  proto.set_max_expanded(query.max_expanded);
  ClassCostsToProto(query.class_costs, *proto.mutable_class_costs());
  proto.set_inferred(ToProto(query.inferred));
  return proto;
}

absl::StatusOr<PlanQuery> FromProto(const v1::PlanPathRequest& proto) {
  PlanQuery query;
  STRATA_ASSIGN_OR_RETURN(query.from, EndpointFromProto("from", proto.from()));
  STRATA_ASSIGN_OR_RETURN(query.to, EndpointFromProto("to", proto.to()));
  query.profile = FromProto(proto.profile());
  STRATA_RETURN_IF_ERROR(ValidateRobotProfile(query.profile));
  STRATA_ASSIGN_OR_RETURN(query.class_costs, ClassCostsFromProto(proto.class_costs()));
  if (proto.has_max_expanded()) query.max_expanded = proto.max_expanded();
  STRATA_ASSIGN_OR_RETURN(query.inferred, FromProto(proto.inferred()));
  return query;
}

v1::PlanPathResponse ToProto(const PlanResult& result) {
  v1::PlanPathResponse proto;
  proto.set_reason(static_cast<v1::PlanReason>(static_cast<int>(result.reason) + kReasonOffset));
  proto.set_message(result.message);
  for (const Eigen::Vector3d& waypoint : result.waypoints) {
    *proto.add_waypoints() = ToProto(waypoint);
  }
  proto.set_length_m(result.length_m);
  proto.set_cost(result.cost);
  proto.set_graph_cost(result.graph_cost);
  for (const PlanGap& gap : result.gaps) {
    v1::PlanGap& added = *proto.add_gaps();
    *added.mutable_from() = ToProto(gap.from);
    *added.mutable_to() = ToProto(gap.to);
    added.set_length_m(gap.length_m);
  }
  proto.set_expanded(result.expanded);
  proto.set_elapsed_ms(result.elapsed_ms);
  proto.set_epoch(result.epoch);
  for (const TileKey& tile : result.tiles) *proto.add_tiles() = ToProto(tile);
  if (result.where.has_value()) *proto.mutable_where() = ToProto(*result.where);
  proto.set_obstruction(static_cast<v1::Obstruction>(result.obstruction));
  proto.set_obstruction_value(result.obstruction_value);
  proto.set_inferred(result.inferred);
  if (result.nearest.has_value()) *proto.mutable_nearest() = ToProto(*result.nearest);
  return proto;
}

absl::StatusOr<PlanResult> FromProto(const v1::PlanPathResponse& proto) {
  PlanResult result;
  STRATA_RETURN_IF_ERROR(ReasonsFromProto(proto, result));
  result.message = proto.message();
  for (const v1::Vector3& waypoint : proto.waypoints()) {
    STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d p, FromProto("waypoint", waypoint));
    result.waypoints.push_back(p);
  }
  result.length_m = proto.length_m();
  result.cost = proto.cost();
  result.graph_cost = proto.graph_cost();
  for (const v1::PlanGap& gap : proto.gaps()) {
    STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d from, FromProto("gap.from", gap.from()));
    STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d to, FromProto("gap.to", gap.to()));
    result.gaps.push_back({from, to, gap.length_m()});
  }
  result.expanded = proto.expanded();
  result.elapsed_ms = proto.elapsed_ms();
  result.epoch = proto.epoch();
  for (const v1::TileKey& tile : proto.tiles()) {
    STRATA_ASSIGN_OR_RETURN(const TileKey key, FromProto(tile));
    result.tiles.push_back(key);
  }
  return result;
}

v1::SurfaceColumn ToProto(const SurfaceColumn& column) {
  v1::SurfaceColumn proto;
  proto.set_x_m(column.x_m);
  proto.set_y_m(column.y_m);
  for (const Surface& surface : column.surfaces) *proto.add_surfaces() = SurfaceToProto(surface);
  return proto;
}

absl::StatusOr<SurfaceColumn> FromProto(const v1::SurfaceColumn& proto) {
  SurfaceColumn column;
  column.x_m = proto.x_m();
  column.y_m = proto.y_m();
  for (const v1::Surface& surface : proto.surfaces()) {
    STRATA_ASSIGN_OR_RETURN(const Surface added, SurfaceFromProto(surface));
    column.surfaces.push_back(added);
  }
  return column;
}

v1::PathCheck ToProto(const PathCheck& check) {
  v1::PathCheck proto;
  proto.set_valid(check.valid);
  proto.set_message(check.message);
  proto.set_valid_m(check.valid_m);
  proto.set_length_m(check.length_m);
  if (check.where.has_value()) *proto.mutable_where() = ToProto(*check.where);
  proto.set_obstruction(static_cast<v1::Obstruction>(check.obstruction));
  proto.set_obstruction_value(check.obstruction_value);
  proto.set_inferred(check.inferred);
  proto.set_epoch(check.epoch);
  proto.set_commit_sequence(check.commit_sequence);
  for (const TileKey& tile : check.tiles) *proto.add_tiles() = ToProto(tile);
  return proto;
}

absl::StatusOr<PathCheck> FromProto(const v1::PathCheck& proto) {
  if (!v1::Obstruction_IsValid(proto.obstruction())) {
    return absl::InvalidArgumentError(absl::StrCat(
        "path check: obstruction ", static_cast<int>(proto.obstruction()), " is not known"));
  }
  PathCheck check;
  check.valid = proto.valid();
  check.message = proto.message();
  check.valid_m = proto.valid_m();
  check.length_m = proto.length_m();
  STRATA_ASSIGN_OR_RETURN(check.where, PlaceFromProto("where", proto.has_where(), proto.where()));
  check.obstruction = static_cast<Obstruction>(proto.obstruction());
  check.obstruction_value = proto.obstruction_value();
  check.inferred = proto.inferred();
  check.epoch = proto.epoch();
  check.commit_sequence = proto.commit_sequence();
  for (const v1::TileKey& tile : proto.tiles()) {
    STRATA_ASSIGN_OR_RETURN(const TileKey key, FromProto(tile));
    check.tiles.push_back(key);
  }
  return check;
}

v1::ListFloorsRequest ToProto(absl::string_view map, const FloorQuery& query) {
  v1::ListFloorsRequest proto;
  proto.set_map(std::string(map));
  *proto.mutable_profile() = ToProto(query.profile);
  if (query.at.has_value()) *proto.mutable_at() = EndpointToProto(*query.at);
  proto.set_min_area_m2(query.min_area_m2);
  proto.set_cells(query.cells);
  if (query.floor.has_value()) proto.set_floor(*query.floor);
  proto.set_inferred(ToProto(query.inferred));
  return proto;
}

absl::StatusOr<FloorQuery> FromProto(const v1::ListFloorsRequest& proto) {
  FloorQuery query;
  query.profile = FromProto(proto.profile());
  STRATA_RETURN_IF_ERROR(ValidateRobotProfile(query.profile));
  if (proto.has_at()) {
    STRATA_ASSIGN_OR_RETURN(query.at, EndpointFromProto("at", proto.at()));
  }
  if (proto.has_min_area_m2()) query.min_area_m2 = proto.min_area_m2();
  query.cells = proto.cells();
  if (proto.has_floor()) query.floor = proto.floor();
  STRATA_ASSIGN_OR_RETURN(query.inferred, FromProto(proto.inferred()));
  return query;
}

v1::ListFloorsResponse ToProto(const FloorPlan& plan) {
  v1::ListFloorsResponse proto;
  for (const Floor& floor : plan.floors) {
    v1::Floor& out = *proto.add_floors();
    out.set_area_m2(floor.area_m2);
    *out.mutable_low() = ToProto(floor.low);
    *out.mutable_high() = ToProto(floor.high);
    out.set_mean_z_m(floor.mean_z_m);
    *out.mutable_place() = ToProto(floor.place);
    for (const FloorBlock& block : floor.blocks) {
      v1::FloorBlock& added = *out.add_blocks();
      added.set_x(block.x);
      added.set_y(block.y);
      added.set_free(block.free);
      added.set_occupied(block.occupied);
      added.set_ground(block.ground);
    }
  }
  for (const FloorLink& link : plan.links) {
    v1::FloorLink& out = *proto.add_links();
    out.set_a(link.a);
    out.set_b(link.b);
    *out.mutable_place() = ToProto(link.place);
    out.set_width_m(link.width_m);
    out.set_slope_rad(link.slope_rad);
  }
  if (plan.at.has_value()) proto.set_at(*plan.at);
  proto.set_message(plan.message);
  proto.set_cell_size_m(plan.cell_size_m);
  proto.set_epoch(plan.epoch);
  proto.set_commit_sequence(plan.commit_sequence);
  return proto;
}

absl::StatusOr<FloorPlan> FromProto(const v1::ListFloorsResponse& proto) {
  FloorPlan plan;
  for (const v1::Floor& floor : proto.floors()) {
    Floor& added = plan.floors.emplace_back();
    added.area_m2 = floor.area_m2();
    STRATA_ASSIGN_OR_RETURN(added.low, FromProto("low", floor.low()));
    STRATA_ASSIGN_OR_RETURN(added.high, FromProto("high", floor.high()));
    added.mean_z_m = floor.mean_z_m();
    STRATA_ASSIGN_OR_RETURN(added.place, FromProto("place", floor.place()));
    for (const v1::FloorBlock& block : floor.blocks()) {
      added.blocks.push_back(
          {block.x(), block.y(), block.free(), block.occupied(), block.ground()});
    }
  }
  for (const v1::FloorLink& link : proto.links()) {
    FloorLink& added = plan.links.emplace_back();
    added.a = link.a();
    added.b = link.b();
    STRATA_ASSIGN_OR_RETURN(added.place, FromProto("place", link.place()));
    added.width_m = link.width_m();
    added.slope_rad = link.slope_rad();
  }
  if (proto.has_at()) plan.at = proto.at();
  plan.message = proto.message();
  plan.cell_size_m = proto.cell_size_m();
  plan.epoch = proto.epoch();
  plan.commit_sequence = proto.commit_sequence();
  return plan;
}

v1::ExploreRequest ToProto(absl::string_view map, const ExploreQuery& query) {
  v1::ExploreRequest proto;
  proto.set_map(std::string(map));
  *proto.mutable_from() = EndpointToProto(query.from);
  *proto.mutable_profile() = ToProto(query.profile);
  ClassCostsToProto(query.class_costs, *proto.mutable_class_costs());
  v1::FieldOfView& sensor = *proto.mutable_sensor();
  sensor.set_up_rad(query.sensor.up_rad);
  sensor.set_down_rad(query.sensor.down_rad);
  sensor.set_width_rad(query.sensor.width_rad);
  sensor.set_rows(query.sensor.rows);
  sensor.set_columns(query.sensor.columns);
  sensor.set_max_range_m(query.sensor.max_range_m);
  proto.set_sensor_height_m(query.sensor_height_m);
  proto.set_count(query.count);
  proto.set_budget_m(query.budget_m);
  proto.set_resolution_m(query.resolution_m);
  if (query.region.has_value()) {
    *proto.mutable_region_min() = ToProto(query.region->min());
    *proto.mutable_region_max() = ToProto(query.region->max());
  }
  proto.set_bits_per_m(query.bits_per_m);
  proto.set_horizon(query.horizon);
  proto.set_min_bits(query.min_bits);
  proto.set_inferred(ToProto(query.inferred));
  return proto;
}

absl::StatusOr<ExploreQuery> FromProto(const v1::ExploreRequest& proto) {
  ExploreQuery query;
  STRATA_ASSIGN_OR_RETURN(query.from, EndpointFromProto("from", proto.from()));
  query.profile = FromProto(proto.profile());
  STRATA_ASSIGN_OR_RETURN(query.class_costs, ClassCostsFromProto(proto.class_costs()));
  const v1::FieldOfView& sensor = proto.sensor();
  if (sensor.has_up_rad()) query.sensor.up_rad = sensor.up_rad();
  if (sensor.has_down_rad()) query.sensor.down_rad = sensor.down_rad();
  if (sensor.has_width_rad()) query.sensor.width_rad = sensor.width_rad();
  if (sensor.has_rows()) query.sensor.rows = sensor.rows();
  if (sensor.has_columns()) query.sensor.columns = sensor.columns();
  if (sensor.has_max_range_m()) query.sensor.max_range_m = sensor.max_range_m();
  if (proto.has_sensor_height_m()) query.sensor_height_m = proto.sensor_height_m();
  if (proto.has_count()) query.count = proto.count();
  if (proto.has_budget_m()) query.budget_m = proto.budget_m();
  if (proto.has_resolution_m()) query.resolution_m = proto.resolution_m();
  if (proto.has_region_min() || proto.has_region_max()) {
    STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d low, FromProto("region_min", proto.region_min()));
    STRATA_ASSIGN_OR_RETURN(const Eigen::Vector3d high,
                            FromProto("region_max", proto.region_max()));
    query.region.emplace(low, high);
  }
  if (proto.has_bits_per_m()) query.bits_per_m = proto.bits_per_m();
  if (proto.has_horizon()) query.horizon = proto.horizon();
  if (proto.has_min_bits()) query.min_bits = proto.min_bits();
  STRATA_ASSIGN_OR_RETURN(query.inferred, FromProto(proto.inferred()));
  STRATA_RETURN_IF_ERROR(ValidateExploreQuery(query));
  return query;
}

v1::ExploreResponse ToProto(const ExploreResult& result) {
  v1::ExploreResponse proto;
  proto.set_reason(static_cast<v1::ExploreReason>(static_cast<int>(result.reason) + kReasonOffset));
  proto.set_message(result.message);
  for (const ExploreView& view : result.views) {
    v1::ExploreView& out = *proto.add_views();
    *out.mutable_pose() = ToProto(view.T_map_sensor);
    *out.mutable_place() = ToProto(view.place);
    out.set_gain_bits(view.gain_bits);
    out.set_volume_m3(view.volume_m3);
    out.set_cost_m(view.cost_m);
    out.set_utility_bits(view.utility_bits);
  }
  proto.set_stands(result.stands);
  if (!result.region.isEmpty()) {
    *proto.mutable_region_min() = ToProto(result.region.min());
    *proto.mutable_region_max() = ToProto(result.region.max());
  }
  proto.set_known_m3(result.known_m3);
  proto.set_region_m3(result.region_m3);
  proto.set_scans(result.scans);
  proto.set_scans_left_out(result.scans_left_out);
  if (result.nearest.has_value()) *proto.mutable_nearest() = ToProto(*result.nearest);
  proto.set_elapsed_ms(result.elapsed_ms);
  proto.set_epoch(result.epoch);
  return proto;
}

absl::StatusOr<ExploreResult> FromProto(const v1::ExploreResponse& proto) {
  ExploreResult result;
  if (proto.reason() < v1::EXPLORE_REASON_VIEWS ||
      proto.reason() > v1::EXPLORE_REASON_START_NOT_ON_SURFACE) {
    return absl::InvalidArgumentError(absl::StrCat("reason: unknown value ", proto.reason()));
  }
  result.reason = static_cast<ExploreReason>(proto.reason() - kReasonOffset);
  result.message = proto.message();
  for (const v1::ExploreView& in : proto.views()) {
    ExploreView& view = result.views.emplace_back();
    STRATA_ASSIGN_OR_RETURN(view.T_map_sensor, FromProto("pose", in.pose()));
    STRATA_ASSIGN_OR_RETURN(view.place, FromProto("place", in.place()));
    view.gain_bits = in.gain_bits();
    view.volume_m3 = in.volume_m3();
    view.cost_m = in.cost_m();
    view.utility_bits = in.utility_bits();
  }
  result.stands = proto.stands();
  if (proto.has_region_min() && proto.has_region_max()) {
    STRATA_ASSIGN_OR_RETURN(result.region.min(), FromProto("region_min", proto.region_min()));
    STRATA_ASSIGN_OR_RETURN(result.region.max(), FromProto("region_max", proto.region_max()));
  }
  result.known_m3 = proto.known_m3();
  result.region_m3 = proto.region_m3();
  result.scans = proto.scans();
  result.scans_left_out = proto.scans_left_out();
  if (proto.has_nearest()) {
    STRATA_ASSIGN_OR_RETURN(result.nearest, FromProto("nearest", proto.nearest()));
  }
  result.elapsed_ms = proto.elapsed_ms();
  result.epoch = proto.epoch();
  return result;
}

v1::CheckPathRequest CheckToProto(absl::string_view map, const PathQuery& query) {
  v1::CheckPathRequest proto = PathToProto<v1::CheckPathRequest>(map, query);
  if (query.known.has_value()) *proto.mutable_known() = ToProto(*query.known);
  return proto;
}

v1::WatchPathRequest WatchToProto(absl::string_view map, const PathQuery& query) {
  return PathToProto<v1::WatchPathRequest>(map, query);
}

absl::StatusOr<PathQuery> FromProto(const v1::CheckPathRequest& proto) {
  STRATA_ASSIGN_OR_RETURN(PathQuery query, PathFromProto(proto));
  if (!proto.has_known()) return query;
  STRATA_ASSIGN_OR_RETURN(query.known, FromProto(proto.known()));
  return query;
}

absl::StatusOr<PathQuery> FromProto(const v1::WatchPathRequest& proto) {
  return PathFromProto(proto);
}

}  // namespace strata::translate
