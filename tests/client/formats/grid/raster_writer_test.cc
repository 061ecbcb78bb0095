// Rasters written by us and read by GDAL; where they lie on earth beside geodesy of the test's own.
#include "client/formats/grid/raster_writer.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include "client/formats/grid/local_projection.h"
#include "core/world/map_info.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

constexpr double kRad = std::numbers::pi / 180.0;
constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

// Heights that differ from cell to cell, nothing in every seventh.
Raster Drawn(int width, int height) {
  Raster raster{.width = width,
                .height = height,
                .cell_size_m = 0.1,
                .x_m = -12.3,
                .y_m = 45.6,
                .bands = {{"height [m]", {}}, {"sigma [m]", {}}},
                .projection = {}};
  for (int i = 0; i < width * height; ++i) {
    const bool known = i % 7 != 3;
    raster.bands[0].values.push_back(known ? 0.01F * static_cast<float>(i) - 20.0F : kNothing);
    raster.bands[1].values.push_back(known ? 0.002F + 1e-6F * static_cast<float>(i) : kNothing);
  }
  return raster;
}

class RasterWriterTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { GDALAllRegister(); }

  std::string Write(const std::string& name, const std::string& bytes) const {
    const std::string path = (dir_.path() / name).string();
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  static GDALDatasetUniquePtr Open(const std::string& path) {
    return GDALDatasetUniquePtr(
        GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_VERBOSE_ERROR));
  }
  // By rows, the lowest y first.
  static std::vector<float> ValuesOf(GDALDataset& dataset, int band) {
    const int width = dataset.GetRasterXSize();
    const int height = dataset.GetRasterYSize();
    std::vector<float> values(static_cast<std::size_t>(width) * height);
    for (int y = 0; y < height; ++y) {
      EXPECT_EQ(
          dataset.GetRasterBand(band)->RasterIO(GF_Read,
                                                0,
                                                height - 1 - y,
                                                width,
                                                1,
                                                values.data() + static_cast<std::size_t>(y) * width,
                                                width,
                                                1,
                                                GDT_Float32,
                                                0,
                                                0),
          CE_None);
    }
    return values;
  }
  static void ExpectPlace(const Raster& raster, GDALDataset& dataset) {
    ASSERT_EQ(dataset.GetRasterXSize(), raster.width);
    ASSERT_EQ(dataset.GetRasterYSize(), raster.height);
    std::array<double, 6> place{};
    ASSERT_EQ(dataset.GetGeoTransform(place.data()), CE_None);
    const std::array<double, 6> expected = {raster.x_m,
                                            raster.cell_size_m,
                                            0.0,
                                            raster.y_m + raster.height * raster.cell_size_m,
                                            0.0,
                                            -raster.cell_size_m};
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(place[i], expected[i], 1e-9) << i;
  }

  testing::TempDir dir_;
};

TEST_F(RasterWriterTest, GdalReadsEveryNumberOfAGeoTiff) {
  const Raster raster = Drawn(301, 977);  // several strips
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, GeoTiffBytes(raster));
  EXPECT_EQ(bytes, *GeoTiffBytes(raster));
  const GDALDatasetUniquePtr dataset = Open(Write("heights.tif", bytes));
  ASSERT_NE(dataset, nullptr);
  ExpectPlace(raster, *dataset);
  const OGRSpatialReference* const nowhere = dataset->GetSpatialRef();
  EXPECT_TRUE(nowhere == nullptr || nowhere->IsLocal());
  ASSERT_EQ(dataset->GetRasterCount(), 2);
  for (int b = 0; b < 2; ++b) {
    GDALRasterBand& band = *dataset->GetRasterBand(b + 1);
    EXPECT_EQ(band.GetDescription(), raster.bands[b].name);
    EXPECT_TRUE(std::isnan(band.GetNoDataValue()));
    EXPECT_THAT(ValuesOf(*dataset, b + 1),
                ::testing::Pointwise(::testing::NanSensitiveFloatEq(), raster.bands[b].values));
  }
}

TEST_F(RasterWriterTest, OneCellIsARaster) {
  Raster raster = Drawn(1, 1);
  raster.bands.resize(1);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, GeoTiffBytes(raster));
  const GDALDatasetUniquePtr dataset = Open(Write("one.tif", bytes));
  ASSERT_NE(dataset, nullptr);
  ExpectPlace(raster, *dataset);
  EXPECT_EQ(ValuesOf(*dataset, 1), raster.bands[0].values);
}

TEST_F(RasterWriterTest, GdalReadsAnAsciiGridWithItsProjection) {
  Raster raster = Drawn(31, 17);
  raster.projection = LocalProjection({.latitude_rad = 0.9, .longitude_rad = 0.2});
  const std::string grid = Write("heights.asc", AscText(raster, raster.bands[0]));
  Write("heights.prj", raster.projection->Wkt());
  const GDALDatasetUniquePtr dataset = Open(grid);
  ASSERT_NE(dataset, nullptr);
  ExpectPlace(raster, *dataset);
  EXPECT_EQ(dataset->GetRasterBand(1)->GetNoDataValue(), kNoData);
  const std::vector<float> values = ValuesOf(*dataset, 1);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float expected = raster.bands[0].values[i];
    EXPECT_NEAR(values[i], std::isnan(expected) ? kNoData : expected, 6e-5) << i;
  }
  ASSERT_NE(dataset->GetSpatialRef(), nullptr);
  EXPECT_NEAR(dataset->GetSpatialRef()->GetProjParm(SRS_PP_LATITUDE_OF_ORIGIN), 0.9 / kRad, 1e-9);
}

// WGS 84 by the book: earth-centred coordinates of a place, and of one on the plane that touches
// the earth at an origin.
Eigen::Vector3d EarthCentred(double latitude, double longitude, double height) {
  constexpr double kA = 6378137.0;
  constexpr double kE2 = 6.69437999014e-3;
  const double n = kA / std::sqrt(1.0 - kE2 * std::sin(latitude) * std::sin(latitude));
  return {(n + height) * std::cos(latitude) * std::cos(longitude),
          (n + height) * std::cos(latitude) * std::sin(longitude),
          (n * (1.0 - kE2) + height) * std::sin(latitude)};
}
Eigen::Vector3d OnThePlane(const GeodeticOrigin& origin, const Eigen::Vector3d& p) {
  const double sin_lat = std::sin(origin.latitude_rad), cos_lat = std::cos(origin.latitude_rad);
  const double sin_lon = std::sin(origin.longitude_rad), cos_lon = std::cos(origin.longitude_rad);
  const Eigen::Vector3d east(-sin_lon, cos_lon, 0.0);
  const Eigen::Vector3d north(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat);
  const Eigen::Vector3d up(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat);
  return EarthCentred(origin.latitude_rad, origin.longitude_rad, origin.altitude_m) + p.x() * east +
         p.y() * north + p.z() * up;
}

TEST_F(RasterWriterTest, CellsLieWhereTheyAreOnEarth) {
  for (const GeodeticOrigin& origin : {GeodeticOrigin{52.5 * kRad, 13.4 * kRad, 34.0},
                                       GeodeticOrigin{-33.4 * kRad, -70.6 * kRad, 570.0},
                                       GeodeticOrigin{0.0, 179.99 * kRad, 0.0},
                                       GeodeticOrigin{78.2 * kRad, 15.6 * kRad, 3000.0}}) {
    Raster raster = Drawn(2, 2);
    const LocalProjection projection(origin);
    raster.projection = projection;
    STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, GeoTiffBytes(raster));
    const GDALDatasetUniquePtr dataset = Open(Write("earth.tif", bytes));
    ASSERT_NE(dataset, nullptr);
    ASSERT_NE(dataset->GetSpatialRef(), nullptr);
    OGRSpatialReference from_wkt;
    ASSERT_EQ(
        from_wkt.importFromESRI(std::array<char*, 2>{projection.Wkt().data(), nullptr}.data()),
        OGRERR_NONE);
    EXPECT_TRUE(from_wkt.IsProjected());
    OGRSpatialReference wgs84;
    wgs84.importFromEPSG(4326);
    wgs84.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    const std::unique_ptr<OGRCoordinateTransformation> to_earth(
        OGRCreateCoordinateTransformation(dataset->GetSpatialRef(), &wgs84));
    ASSERT_NE(to_earth, nullptr);
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 0),
                                     Eigen::Vector3d(1000, 0, 0),
                                     Eigen::Vector3d(-700, 700, 5),
                                     Eigen::Vector3d(0, -5000, 0),
                                     Eigen::Vector3d(7000, 7000, 0)}) {
      double longitude = p.x();
      double latitude = p.y();
      ASSERT_TRUE(to_earth->Transform(1, &longitude, &latitude));
      const double height = projection.EllipsoidHeight(p);
      const Eigen::Vector3d told = EarthCentred(latitude * kRad, longitude * kRad, height);
      EXPECT_LT((told - OnThePlane(origin, p)).norm(), 0.007)
          << p.transpose() << " at " << origin.latitude_rad / kRad;
    }
  }
}

}  // namespace
}  // namespace strata
