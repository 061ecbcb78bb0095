#include "proto/translate/maps.h"

#include <cstdint>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "proto/translate/geometry.h"

namespace strata::translate {
namespace {

v1::MlsParameters MlsToProto(const MlsParameters& mls) {
  v1::MlsParameters proto;
  proto.set_cell_size_m(mls.cell_size_m);
  proto.set_gap_size_m(mls.gap_size_m);
  proto.set_thickness_m(mls.thickness_m);
  return proto;
}

MlsParameters MlsFromProto(const v1::MlsParameters& proto) {
  MlsParameters mls;
  if (proto.has_cell_size_m()) mls.cell_size_m = proto.cell_size_m();
  if (proto.has_gap_size_m()) mls.gap_size_m = proto.gap_size_m();
  if (proto.has_thickness_m()) mls.thickness_m = proto.thickness_m();
  return mls;
}

}  // namespace

v1::RobotProfile ToProto(const RobotProfile& profile) {
  v1::RobotProfile proto;
  proto.set_radius_m(profile.radius_m);
  proto.set_height_m(profile.height_m);
  proto.set_max_step_m(profile.max_step_m);
  proto.set_max_slope_rad(profile.max_slope_rad);
  proto.set_max_gap_m(profile.max_gap_m);
  proto.set_max_roughness_m(profile.max_roughness_m);
  return proto;
}

RobotProfile FromProto(const v1::RobotProfile& proto) {
  RobotProfile profile;
  if (proto.has_radius_m()) profile.radius_m = proto.radius_m();
  if (proto.has_height_m()) profile.height_m = proto.height_m();
  if (proto.has_max_step_m()) profile.max_step_m = proto.max_step_m();
  if (proto.has_max_slope_rad()) profile.max_slope_rad = proto.max_slope_rad();
  if (proto.has_max_gap_m()) profile.max_gap_m = proto.max_gap_m();
  if (proto.has_max_roughness_m()) profile.max_roughness_m = proto.max_roughness_m();
  return profile;
}

v1::SensorModel ToProto(const SensorModel& model) {
  v1::SensorModel proto;
  proto.set_sigma_m(model.sigma_m);
  proto.set_sigma_per_metre(model.sigma_per_metre);
  proto.set_min_range_m(model.min_range_m);
  proto.set_max_range_m(model.max_range_m);
  return proto;
}

SensorModel FromProto(const v1::SensorModel& proto) {
  SensorModel model;
  if (proto.has_sigma_m()) model.sigma_m = proto.sigma_m();
  if (proto.has_sigma_per_metre()) model.sigma_per_metre = proto.sigma_per_metre();
  if (proto.has_min_range_m()) model.min_range_m = proto.min_range_m();
  if (proto.has_max_range_m()) model.max_range_m = proto.max_range_m();
  return model;
}

v1::GeodeticOrigin ToProto(const GeodeticOrigin& origin) {
  v1::GeodeticOrigin proto;
  proto.set_latitude_rad(origin.latitude_rad);
  proto.set_longitude_rad(origin.longitude_rad);
  proto.set_altitude_m(origin.altitude_m);
  return proto;
}

GeodeticOrigin FromProto(const v1::GeodeticOrigin& proto) {
  return {proto.latitude_rad(), proto.longitude_rad(), proto.altitude_m()};
}

v1::MapParameters ToProto(const MapParameters& parameters) {
  v1::MapParameters proto;
  *proto.mutable_mls() = MlsToProto(parameters.mls);
  *proto.mutable_sensor() = ToProto(parameters.sensor);
  *proto.mutable_default_profile() = ToProto(parameters.default_profile);
  proto.set_keep_points(parameters.keep_points);
  proto.set_fade_after(parameters.fade_after);
  if (parameters.origin.has_value()) *proto.mutable_origin() = ToProto(*parameters.origin);
  return proto;
}

MapParameters FromProto(const v1::MapParameters& proto) {
  MapParameters parameters;
  parameters.mls = MlsFromProto(proto.mls());
  parameters.sensor = FromProto(proto.sensor());
  parameters.default_profile = FromProto(proto.default_profile());
  if (proto.has_keep_points()) parameters.keep_points = proto.keep_points();
  parameters.fade_after = proto.fade_after();
  if (proto.has_origin()) parameters.origin = FromProto(proto.origin());
  return parameters;
}

v1::MapInfo ToProto(const MapInfo& map) {
  v1::MapInfo proto;
  proto.set_name(map.name);
  *proto.mutable_parameters() = ToProto(map.parameters);
  *proto.mutable_created() = ToProto(map.created);
  return proto;
}

absl::StatusOr<MapInfo> FromProto(const v1::MapInfo& proto) {
  MapInfo map;
  map.name = proto.name();
  map.parameters = FromProto(proto.parameters());
  STRATA_ASSIGN_OR_RETURN(map.created, FromProto("created", proto.created()));
  return map;
}

v1::MapStats ToProto(const MapStats& stats) {
  v1::MapStats proto;
  proto.set_scans(stats.scans);
  proto.set_scans_pending(stats.scans_pending);
  proto.set_scans_failed(stats.scans_failed);
  proto.set_points(stats.points);
  proto.set_patches(stats.patches);
  proto.set_occupied_cells(stats.occupied_cells);
  proto.set_tiles(stats.tiles);
  proto.set_tiles_prepared(stats.tiles_prepared);
  proto.set_tile_bytes(stats.tile_bytes);
  proto.set_point_bytes(stats.point_bytes);
  proto.set_epoch(stats.epoch);
  proto.set_commit_sequence(stats.commit_sequence);
  proto.set_surface_spread_m(stats.surface_spread_m);
  proto.set_content_digest(stats.content_digest);
  *proto.mutable_box_min() = ToProto(stats.box_min);
  *proto.mutable_box_max() = ToProto(stats.box_max);
  return proto;
}

absl::StatusOr<MapStats> FromProto(const v1::MapStats& proto) {
  MapStats stats;
  stats.scans = proto.scans();
  stats.scans_pending = proto.scans_pending();
  stats.scans_failed = proto.scans_failed();
  stats.points = proto.points();
  stats.patches = proto.patches();
  stats.occupied_cells = proto.occupied_cells();
  stats.tiles = proto.tiles();
  stats.tiles_prepared = proto.tiles_prepared();
  stats.tile_bytes = proto.tile_bytes();
  stats.point_bytes = proto.point_bytes();
  stats.epoch = proto.epoch();
  stats.commit_sequence = proto.commit_sequence();
  stats.surface_spread_m = proto.surface_spread_m();
  stats.content_digest = proto.content_digest();
  STRATA_ASSIGN_OR_RETURN(stats.box_min, FromProto("box_min", proto.box_min()));
  STRATA_ASSIGN_OR_RETURN(stats.box_max, FromProto("box_max", proto.box_max()));
  return stats;
}

v1::MapClass ToProto(const MapClass& map_class) {
  v1::MapClass proto;
  proto.set_id(map_class.id);
  proto.set_name(map_class.name);
  proto.set_colour(PackedRgb(map_class.colour));
  return proto;
}

absl::StatusOr<MapClass> FromProto(const v1::MapClass& proto) {
  if (proto.id() > 0xFFFF || proto.colour() > 0xFFFFFF) {
    return absl::InvalidArgumentError(absl::StrCat("class: id = ",
                                                   proto.id(),
                                                   " or colour = ",
                                                   proto.colour(),
                                                   " does not fit; at most 255 and 0xFFFFFF"));
  }
  return MapClass{
      static_cast<std::uint16_t>(proto.id()), proto.name(), ColourOfRgb(proto.colour())};
}

v1::BackupMapResponse ToProto(const api::BackupPiece& piece) {
  v1::BackupMapResponse proto;
  proto.set_bytes(piece.bytes);
  proto.set_total_bytes(piece.total_bytes);
  proto.set_content_hash(piece.content_hash);
  return proto;
}

api::BackupPiece FromProto(const v1::BackupMapResponse& proto) {
  return {.bytes = proto.bytes(),
          .total_bytes = proto.total_bytes(),
          .content_hash = proto.content_hash()};
}

}  // namespace strata::translate
