#include "client/formats/planes/plane_model_file.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/file_bytes.h"
#include "client/formats/ply_reader.h"
#include "core/cloud/point_cloud.h"
#include "tests/support/dxf_entities.h"
#include "tests/support/simulator/plane_room.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using ::strata::testing::DxfEntity;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kDegrees = 180.0 / std::numbers::pi;

PlaneModel FarRoom() {
  return testing::Moved(testing::DrawnRoom(),
                        Eigen::Translation3d(500'000.125, -500'000.25, 300.5) *
                            Eigen::Isometry3d(Eigen::AngleAxisd(0.4, Vector3d::UnitZ())));
}

double AreaOfModel(const PlaneModel& model) {
  double area = 0.0;
  for (const ModelPlane& plane : model.planes) area += plane.area_m2;
  return area;
}

TEST(PlaneModelFileTest, TrianglesHaveTheAreaAndTheNormalsOfTheirPlanes) {
  for (const PlaneModel& model : {testing::DrawnRoom(), FarRoom()}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const Geometry geometry, PlaneModelGeometry(model));
    double area = 0.0;
    for (const auto& [a, b, c] : geometry.triangles) {
      const Vector3d cross = (geometry.vertices[b] - geometry.vertices[a])
                                 .cross(geometry.vertices[c] - geometry.vertices[a]);
      area += cross.norm() / 2.0;
      EXPECT_GT(cross.normalized().dot(geometry.normals[a].cast<double>()), 0.999);
    }
    EXPECT_NEAR(area, AreaOfModel(model), 1e-3);
  }
}

TEST(PlaneModelFileTest, APlaneHasItsOwnColourOrThatOfItsKind) {
  PlaneModel model = testing::DrawnRoom();
  model.planes[1].colour = Colour{160, 45, 40};
  STRATA_ASSERT_OK_AND_ASSIGN(const Geometry geometry, PlaneModelGeometry(model));
  std::set<std::uint32_t> colours;
  for (const Colour& colour : geometry.colour) colours.insert(PackedRgb(colour));
  EXPECT_THAT(colours, ::testing::UnorderedElementsAre(0xA02D28U, 0x3E68D6U, 0xFFD630U));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string text, PlaneModelGeoJson(model, std::nullopt));
  const auto json = nlohmann::json::parse(text);
  EXPECT_EQ(json["features"][1]["properties"]["colour"], "#a02d28");
  EXPECT_TRUE(json["features"][0]["properties"]["colour"].is_null());
}

TEST(PlaneModelFileTest, DxfHasFacesBordersAndLayers) {
  for (const PlaneModel& model : {testing::DrawnRoom(), FarRoom()}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const std::string text, PlaneModelDxf(model));
    EXPECT_THAT(text, Not(HasSubstr("nan")));
    std::map<std::string, double> area;
    std::map<std::string, int> rings;
    std::map<std::string, int> corners;
    for (const DxfEntity& e : testing::DxfSection(text, "ENTITIES")) {
      if (e.kind == "3DFACE") {
        area[e.layer()] +=
            testing::RingAreaOf({e.Point(10), e.Point(11), e.Point(12), e.Point(13)});
      }
      rings[e.layer()] += e.kind == "POLYLINE" ? 1 : 0;
      corners[e.layer()] += e.kind == "VERTEX" ? 1 : 0;
    }
    EXPECT_NEAR(area["WALL"], 8.2 + 8.8 + 6.2 + 7.5, 1e-3);
    EXPECT_NEAR(area["LEVEL"], 12.0 + 11.75, 1e-3);
    EXPECT_EQ(rings["WALL"], 5);  // four walls and a window
    EXPECT_EQ(corners["WALL"], 4 + 4 + 8 + 4 + 4);
    EXPECT_EQ(rings["LEVEL"], 3);
    EXPECT_EQ(rings["UNSEEN"], 1);
    std::map<std::string, bool> layers;
    for (const DxfEntity& e : testing::DxfSection(text, "TABLES")) {
      if (e.kind == "LAYER") layers[e.values.at(2)] = true;
    }
    for (const auto& [layer, count] : rings) EXPECT_TRUE(layers[layer]) << layer;
    EXPECT_TRUE(text.ends_with("0\nENDSEC\n0\nEOF\n"));
  }
}

TEST(PlaneModelFileTest, DxfCornersAreThoseOfTheModelFarFromTheOrigin) {
  const PlaneModel model = FarRoom();
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string text, PlaneModelDxf(model));
  std::vector<Vector3d> read;
  for (const DxfEntity& e : testing::DxfSection(text, "ENTITIES")) {
    if (e.kind == "VERTEX") read.push_back(e.Point(10));
  }
  std::size_t at = 0;
  for (const ModelPlane& plane : model.planes) {
    for (const Vector3d& p : plane.polygons[0].outer) EXPECT_LT((read.at(at++) - p).norm(), 2e-6);
    for (const PlaneHole& hole : plane.polygons[0].holes) {
      for (const Vector3d& p : hole.ring) EXPECT_LT((read.at(at++) - p).norm(), 2e-6);
    }
  }
  EXPECT_EQ(at, read.size());
}

TEST(PlaneModelFileTest, GeoJsonOfAMapThatIsNowhereOnEarthIsInItsMetres) {
  const PlaneModel model = FarRoom();
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string text, PlaneModelGeoJson(model, std::nullopt));
  const auto json = nlohmann::json::parse(text);
  EXPECT_EQ(json["type"], "FeatureCollection");
  EXPECT_EQ(json["frame"], "map [m]");
  ASSERT_EQ(json["features"].size(), model.planes.size());
  for (std::size_t i = 0; i < model.planes.size(); ++i) {
    const ModelPlane& plane = model.planes[i];
    const auto& feature = json["features"][i];
    EXPECT_EQ(feature["properties"]["plane"], plane.id);
    EXPECT_EQ(feature["properties"]["kind"], i < 2 ? "level" : "wall");
    EXPECT_TRUE(feature["properties"]["direction"].is_null());
    EXPECT_EQ(feature["properties"]["holes_seen_open"].size(), plane.polygons[0].holes.size());
    double area = 0.0;
    for (const auto& ring : feature["geometry"]["coordinates"]) {
      EXPECT_EQ(ring.front(), ring.back());
      PlaneRing points;
      for (const auto& p : ring) points.emplace_back(p[0], p[1], p[2]);
      area += (area == 0.0 ? 1.0 : -1.0) * testing::RingAreaOf(points);
      // RFC 7946: borders counterclockwise from above, holes clockwise.
      if (i < 2) {
        EXPECT_EQ(testing::DoubleAreaOf(points).z() > 0.0,
                  &ring == &feature["geometry"]["coordinates"][0]);
      }
    }
    EXPECT_NEAR(area, plane.area_m2, 2e-3);
  }
  EXPECT_EQ(json["features"][2]["properties"]["holes_seen_open"][0], true);
  EXPECT_EQ(json["features"][5]["properties"]["holes_seen_open"][0], false);
}

// From longitude, latitude and height back into the map by the forward formula.
Vector3d InMap(const GeodeticOrigin& origin, double lon_deg, double lat_deg, double height_m) {
  const auto on_earth = [](double lat, double lon, double h) {
    const double a = 6378137.0, b = 6356752.314245179;
    const double n = a * a / std::hypot(a * std::cos(lat), b * std::sin(lat));
    return Vector3d((n + h) * std::cos(lat) * std::cos(lon),
                    (n + h) * std::cos(lat) * std::sin(lon),
                    (b * b / (a * a) * n + h) * std::sin(lat));
  };
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(origin.longitude_rad, Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(-origin.latitude_rad, Vector3d::UnitY()))
                                   .toRotationMatrix();
  const Vector3d d =
      turn.transpose() * (on_earth(lat_deg / kDegrees, lon_deg / kDegrees, height_m) -
                          on_earth(origin.latitude_rad, origin.longitude_rad, origin.altitude_m));
  return {d.y(), d.z(), d.x()};
}

TEST(PlaneModelFileTest, GeoJsonOfAMapOnEarthIsLongitudeLatitudeHeight) {
  const GeodeticOrigin origin{48.137 / kDegrees, 11.575 / kDegrees, 519.0};
  for (const PlaneModel& model : {testing::DrawnRoom(), FarRoom()}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const std::string text, PlaneModelGeoJson(model, origin));
    const auto json = nlohmann::json::parse(text);
    EXPECT_EQ(json["frame"], "WGS 84");
    const PlaneRing& ring = model.planes[1].polygons[0].outer;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const auto& p = json["features"][1]["geometry"]["coordinates"][0][i];
      EXPECT_LT((InMap(origin, p[0], p[1], p[2]) - ring[i]).norm(), 1e-3);
    }
  }
}

TEST(PlaneModelFileTest, EveryFileIsWrittenByItsEnding) {
  const testing::TempDir dir;
  for (const char* name : {"a.ply", "a.obj", "a.glb", "a.dxf", "a.geojson", "B.DXF"}) {
    STRATA_EXPECT_OK(WritePlaneModel(dir.path() / name, testing::DrawnRoom(), std::nullopt));
    STRATA_EXPECT_OK(ReadFileBytes(dir.path() / name));
    STRATA_EXPECT_OK(WritePlaneModel(dir.path() / name, {}, std::nullopt));
    STRATA_EXPECT_OK(ReadFileBytes(dir.path() / name));
  }
  STRATA_ASSERT_OK(WritePlaneModel(dir.path() / "a.ply", FarRoom(), std::nullopt));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string ply, ReadFileBytes(dir.path() / "a.ply"));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadPly(ply));
  const Vector3d first = cloud.origin + cloud.points[0].cast<double>();
  EXPECT_LT((first - Vector3d(500'000, -500'000, 300)).norm(), 10.0);
}

TEST(PlaneModelFileTest, AnEmptyModelIsAFileWithoutPolygons) {
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string text, PlaneModelGeoJson({}, std::nullopt));
  EXPECT_TRUE(nlohmann::json::parse(text)["features"].empty());
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string dxf, PlaneModelDxf({}));
  EXPECT_TRUE(testing::DxfSection(dxf, "ENTITIES").empty());
}

TEST(PlaneModelFileTest, WhatCannotBeWrittenSaysWhy) {
  const testing::TempDir dir;
  EXPECT_THAT(WritePlaneModel(dir.path() / "a.dwg", testing::DrawnRoom(), std::nullopt),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(".geojson, got ")));
  EXPECT_THAT(WritePlaneModel(dir.path() / "no" / "a.dxf", testing::DrawnRoom(), std::nullopt),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("no/a.dxf")));
  PlaneModel broken = testing::DrawnRoom();
  broken.planes[0].polygons[0].outer[0].z() = HUGE_VAL;
  for (const char* name : {"a.ply", "a.dxf", "a.geojson"}) {
    EXPECT_THAT(WritePlaneModel(dir.path() / name, broken, std::nullopt),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("plane 1: corner")));
  }
}

}  // namespace
}  // namespace strata
