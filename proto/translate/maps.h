// Maps between the core's words and the wire's. FromProto checks form only (finite numbers, known
// enumerators); ranges are the database's to check. Absent fields take the core's defaults.
#ifndef STRATA_PROTO_TRANSLATE_MAPS_H_
#define STRATA_PROTO_TRANSLATE_MAPS_H_

#include "absl/status/statusor.h"

#include "core/api/maps.h"
#include "core/cloud/sensor_model.h"
#include "core/world/map_class.h"
#include "core/world/map_info.h"
#include "core/world/robot_profile.h"
#include "strata/v1/maps.pb.h"
#include "strata/v1/robot_profile.pb.h"
#include "strata/v1/sensor_model.pb.h"

namespace strata::translate {

v1::RobotProfile ToProto(const RobotProfile& profile);
v1::SensorModel ToProto(const SensorModel& model);
v1::GeodeticOrigin ToProto(const GeodeticOrigin& origin);
v1::MapParameters ToProto(const MapParameters& parameters);
v1::MapInfo ToProto(const MapInfo& map);
v1::MapStats ToProto(const MapStats& stats);
v1::MapClass ToProto(const MapClass& map_class);
v1::BackupMapResponse ToProto(const api::BackupPiece& piece);

RobotProfile FromProto(const v1::RobotProfile& profile);
SensorModel FromProto(const v1::SensorModel& model);
GeodeticOrigin FromProto(const v1::GeodeticOrigin& origin);
MapParameters FromProto(const v1::MapParameters& parameters);
absl::StatusOr<MapInfo> FromProto(const v1::MapInfo& map);
absl::StatusOr<MapStats> FromProto(const v1::MapStats& stats);
absl::StatusOr<MapClass> FromProto(const v1::MapClass& map_class);
api::BackupPiece FromProto(const v1::BackupMapResponse& piece);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_MAPS_H_
