#include "client/cli/objects/entity_files.h"

#include <numbers>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>

#include "client/cli/terminal/json.h"
#include "client/formats/file_bytes.h"
#include "core/world/things/kind.h"

namespace strata::cli {
namespace {

constexpr double kDegreesOfRadian = 180.0 / std::numbers::pi;

// [longitude, latitude, altitude], or the place in the map.
Json GeoJsonPlace(const Eigen::Vector3d& p_map, const std::optional<LocalFrame>& earth) {
  if (!earth.has_value()) return ToJson(p_map);
  const GeodeticOrigin place = earth->ToEarth(p_map);
  return {place.longitude_rad * kDegreesOfRadian,
          place.latitude_rad * kDegreesOfRadian,
          place.altitude_m};
}

// null: of none.
Json EntityKindJson(const std::optional<EntityKind>& kind) {
  if (!kind.has_value()) return nullptr;
  return {{"id", KindIdText(kind->id)},
          {"name", kind->name},
          {"T_map_kind", ToJson(kind->T_map_kind)},
          {"residual_m", kind->residual_m},
          {"overlap", kind->overlap}};
}

}  // namespace

std::string KindText(const Entity& entity) {
  if (!entity.kind.has_value()) return "";
  return entity.kind->name.empty() ? KindIdText(entity.kind->id) : entity.kind->name;
}

Json EntityJson(const Entity& entity, const std::vector<MapClass>& classes) {
  Json scans = Json::object();
  for (const EntityScan& seen : entity.scans) scans[seen.scan.ToString()] = seen.points;
  return {{"id", entity.id},
          {"kind", EntityKindJson(entity.kind)},
          {"class", ClassOf(classes, entity.class_id).name},
          {"class_id", entity.class_id},
          {"centre", ToJson(entity.box.centre)},
          {"size_m", ToJson(entity.box.size)},
          {"yaw_rad", entity.box.yaw_rad},
          {"radius_m", entity.radius_m},
          {"points", entity.points},
          {"scans", scans}};
}

std::string EntitiesGeoJson(const FetchedEntities& fetched,
                            const std::optional<LocalFrame>& earth) {
  Json features = Json::array();
  for (const Entity& entity : fetched.entities) {
    Json ring = Json::array();
    for (const Eigen::Vector3d& p : BaseOf(entity.box)) ring.push_back(GeoJsonPlace(p, earth));
    ring.push_back(ring.front());
    features.push_back({{"type", "Feature"},
                        {"properties", EntityJson(entity, fetched.classes)},
                        {"geometry", {{"type", "Polygon"}, {"coordinates", Json::array({ring})}}}});
  }
  const Json all = {{"type", "FeatureCollection"},
                    {"frame", earth.has_value() ? "WGS 84" : "map [m]"},
                    {"features", features}};
  return all.dump() + "\n";
}

std::string EntitiesCsv(const FetchedEntities& fetched) {
  std::string out = "id,class,x,y,z,length,width,height,yaw,points,scans,kind\n";
  for (const Entity& entity : fetched.entities) {
    const UprightBox& box = entity.box;
    absl::StrAppendFormat(&out,
                          "%d,%s,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%.4f,%d,%d,%s\n",
                          entity.id,
                          ClassOf(fetched.classes, entity.class_id).name,
                          box.centre.x(),
                          box.centre.y(),
                          box.centre.z(),
                          box.size.x(),
                          box.size.y(),
                          box.size.z(),
                          box.yaw_rad,
                          entity.points,
                          entity.scans.size(),
                          KindText(entity));
  }
  return out;
}

absl::Status WriteEntities(const std::filesystem::path& path,
                           const FetchedEntities& fetched,
                           const std::optional<LocalFrame>& earth) {
  const std::string ending = absl::AsciiStrToLower(path.extension().string());
  if (ending == ".geojson") return WriteFileBytes(path, EntitiesGeoJson(fetched, earth));
  if (ending == ".csv") return WriteFileBytes(path, EntitiesCsv(fetched));
  return absl::InvalidArgumentError(
      absl::StrCat("entities are written as .geojson and .csv, and drawn by map render --objects; "
                   "got ",
                   path.string()));
}

}  // namespace strata::cli
