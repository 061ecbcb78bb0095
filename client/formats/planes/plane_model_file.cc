#include "client/formats/planes/plane_model_file.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "client/formats/file_bytes.h"
#include "client/formats/planes/dxf_drawing.h"
#include "client/formats/planes/polygon_pieces.h"
#include "core/common/status.h"
#include "core/egomotion/geodesy.h"
#include "core/world/constraint.h"

namespace strata {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr char kUnseenLayer[] = "UNSEEN";

struct KindLook {
  const char* name;
  const char* layer;
  Colour colour;
};

const KindLook& LookOf(PlaneKind kind) {
  static constexpr KindLook kWallLook = {"wall", "WALL", {62, 104, 214}};
  static constexpr KindLook kLevelLook = {"level", "LEVEL", {255, 214, 48}};
  static constexpr KindLook kSlopedLook = {"sloped", "SLOPED", {222, 62, 50}};
  if (kind == PlaneKind::kWall) return kWallLook;
  return kind == PlaneKind::kLevel ? kLevelLook : kSlopedLook;
}

void AddPiece(const FlatPiece& piece, const ModelPlane& plane, Geometry& geometry) {
  const auto first = static_cast<std::uint32_t>(geometry.vertices.size());
  const std::size_t corners = piece[2] == piece[3] ? 3 : 4;
  for (std::size_t i = 0; i < corners; ++i) {
    geometry.vertices.push_back(piece[i]);
    geometry.normals.emplace_back(plane.plane.normal.cast<float>());
    geometry.colour.push_back(plane.colour.value_or(LookOf(plane.kind).colour));
  }
  geometry.triangles.push_back({first, first + 1, first + 2});
  if (corners == 4) geometry.triangles.push_back({first, first + 2, first + 3});
}

// Rings are written with the first point repeated, and counterclockwise from above: those of planes
// that look down are turned.
void AddGeoJsonRing(const PlaneRing& ring,
                    bool turned,
                    const std::optional<LocalFrame>& earth,
                    std::string& out) {
  out += '[';
  for (std::size_t i = 0; i <= ring.size(); ++i) {
    const std::size_t at = i % ring.size();
    const Eigen::Vector3d& p = ring[turned ? ring.size() - 1 - at : at];
    if (i > 0) out += ',';
    if (earth.has_value()) {
      const GeodeticOrigin place = earth->ToEarth(p);
      absl::StrAppendFormat(&out,
                            "[%.9f,%.9f,%.4f]",
                            place.longitude_rad * kDegrees,
                            place.latitude_rad * kDegrees,
                            place.altitude_m);
    } else {
      absl::StrAppendFormat(&out, "[%.4f,%.4f,%.4f]", p.x(), p.y(), p.z());
    }
  }
  out += ']';
}

std::string GeoJsonFeature(const ModelPlane& plane,
                           const PlanePolygon& polygon,
                           const std::optional<LocalFrame>& earth) {
  std::string holes_open;
  for (const PlaneHole& hole : polygon.holes) {
    absl::StrAppend(&holes_open, holes_open.empty() ? "" : ",", hole.seen_open ? "true" : "false");
  }
  std::string out = absl::StrFormat(
      R"({"type":"Feature","properties":{"plane":%d,"kind":"%s","direction":%s,"area_m2":%.4f,)"
      R"("rms_m":%.6f,"sigma_m":%.6f,"colour":%s,"holes_seen_open":[%s]},)"
      R"("geometry":{"type":"Polygon","coordinates":[)",
      plane.id,
      LookOf(plane.kind).name,
      plane.direction == kNoDirection ? "null" : absl::StrCat(plane.direction),
      polygon.area_m2,
      plane.rms_m,
      plane.sigma_m,
      plane.colour.has_value() ? absl::StrFormat("\"#%06x\"", PackedRgb(*plane.colour)) : "null",
      holes_open);
  const bool turned = plane.plane.normal.z() < 0.0;
  AddGeoJsonRing(polygon.outer, turned, earth, out);
  for (const PlaneHole& hole : polygon.holes) {
    out += ',';
    AddGeoJsonRing(hole.ring, turned, earth, out);
  }
  return out + "]}}";
}

}  // namespace

absl::StatusOr<Geometry> PlaneModelGeometry(const PlaneModel& model) {
  STRATA_RETURN_IF_ERROR(CheckPlaneModel(model));
  Geometry geometry;
  for (const ModelPlane& plane : model.planes) {
    for (const PlanePolygon& polygon : plane.polygons) {
      for (const FlatPiece& piece : PiecesOf(polygon, plane.plane.normal)) {
        AddPiece(piece, plane, geometry);
      }
    }
  }
  return geometry;
}

absl::StatusOr<std::string> PlaneModelDxf(const PlaneModel& model) {
  STRATA_RETURN_IF_ERROR(CheckPlaneModel(model));
  DxfDrawing drawing({{LookOf(PlaneKind::kWall).layer, 5},
                      {LookOf(PlaneKind::kLevel).layer, 2},
                      {LookOf(PlaneKind::kSloped).layer, 1},
                      {kUnseenLayer, 8, true}});
  for (const ModelPlane& plane : model.planes) {
    const char* const layer = LookOf(plane.kind).layer;
    for (const PlanePolygon& polygon : plane.polygons) {
      for (const FlatPiece& piece : PiecesOf(polygon, plane.plane.normal)) {
        drawing.AddFace(layer, piece);
      }
      drawing.AddRing(layer, polygon.outer);
      for (const PlaneHole& hole : polygon.holes) {
        drawing.AddRing(hole.seen_open ? layer : kUnseenLayer, hole.ring);
      }
    }
  }
  return drawing.Text();
}

absl::StatusOr<std::string> PlaneModelGeoJson(const PlaneModel& model,
                                              const std::optional<GeodeticOrigin>& origin) {
  std::optional<LocalFrame> earth;
  if (origin.has_value()) earth.emplace(*origin);
  STRATA_RETURN_IF_ERROR(CheckPlaneModel(model));
  std::string features;
  for (const ModelPlane& plane : model.planes) {
    for (const PlanePolygon& polygon : plane.polygons) {
      absl::StrAppend(
          &features, features.empty() ? "\n" : ",\n", GeoJsonFeature(plane, polygon, earth));
    }
  }
  return absl::StrCat(R"({"type":"FeatureCollection","frame":")",
                      origin.has_value() ? "WGS 84" : "map [m]",
                      R"(","features":[)",
                      features,
                      "]}\n");
}

absl::Status WritePlaneModel(const std::filesystem::path& path,
                             const PlaneModel& model,
                             const std::optional<GeodeticOrigin>& origin) {
  const std::string ending = absl::AsciiStrToLower(path.extension().string());
  if (ending == ".dxf") {
    STRATA_ASSIGN_OR_RETURN(const std::string text, PlaneModelDxf(model));
    return WriteFileBytes(path, text);
  }
  if (ending == ".geojson") {
    STRATA_ASSIGN_OR_RETURN(const std::string text, PlaneModelGeoJson(model, origin));
    return WriteFileBytes(path, text);
  }
  if (ending != ".ply" && ending != ".obj" && ending != ".glb") {
    return absl::InvalidArgumentError(absl::StrCat(
        "planes are written as .ply, .obj, .glb, .dxf and .geojson, got ", path.string()));
  }
  STRATA_ASSIGN_OR_RETURN(const MeshFormat format, MeshFormatOf(ending));
  STRATA_ASSIGN_OR_RETURN(const Geometry geometry, PlaneModelGeometry(model));
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, MeshBytes(format, geometry));
  return WriteFileBytes(path, bytes);
}

}  // namespace strata
