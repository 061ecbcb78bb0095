// Planes of a map as files for CAD, GIS and viewers.
#ifndef STRATA_CLIENT_FORMATS_PLANES_PLANE_MODEL_FILE_H_
#define STRATA_CLIENT_FORMATS_PLANES_PLANE_MODEL_FILE_H_

#include <filesystem>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/formats/geometry_writer.h"
#include "core/world/map_info.h"
#include "core/world/plane_model.h"

namespace strata {

// The polygons in the map frame. All of these: INVALID_ARGUMENT for a model that CheckPlaneModel
// does not take; without polygons a file without any.

// Triangles of each polygon on vertices of its own, with the plane's normal and its colour, or
// where it has none that of its kind: walls blue, level planes yellow, sloped ones red.
absl::StatusOr<Geometry> PlaneModelGeometry(const PlaneModel& model);

// DXF in metres: layers WALL, LEVEL and SLOPED with faces and borders; borders of holes of which
// nothing is known are on layer UNSEEN.
absl::StatusOr<std::string> PlaneModelDxf(const PlaneModel& model);

// A FeatureCollection (RFC 7946), a Feature with a Polygon for each polygon, with the numbers of
// its plane as properties; "holes_seen_open" says it of each hole in order. Coordinates: longitude,
// latitude and height above the ellipsoid where the map has an origin, else metres of the map,
// which RFC 7946 does not know; the member "frame" says which: "WGS 84" or "map [m]".
absl::StatusOr<std::string> PlaneModelGeoJson(const PlaneModel& model,
                                              const std::optional<GeodeticOrigin>& origin);

// By the ending of the file's name: .ply, .obj, .glb, .dxf, .geojson. INVALID_ARGUMENT naming these
// for another one, FAILED_PRECONDITION if the file cannot be written.
absl::Status WritePlaneModel(const std::filesystem::path& path,
                             const PlaneModel& model,
                             const std::optional<GeodeticOrigin>& origin);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PLANES_PLANE_MODEL_FILE_H_
