#include "client/formats/survey/las_reader.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/scan_reader.h"
#include "client/formats/survey/las_units.h"
#include "tests/client/formats/hostile_files.h"
#include "tests/support/data_dir.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::PutAt;
using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// One point as the specification has it, with what the formats may hold besides.
struct LasPoint {
  std::int32_t x, y, z;
  std::uint16_t intensity = 0;
  std::uint8_t classification = 0;
  bool withheld = false;
  double time = 0.0;
  std::uint16_t red = 0, green = 0, blue = 0;
};

// Where fields are, from the tables of the specification (R15, November 2019).
struct Layout {
  std::uint8_t format;
  std::uint16_t bytes;
  std::size_t time, red;
};
constexpr Layout kLayouts[] = {{0, 20, 0, 0},
                               {1, 28, 20, 0},
                               {2, 26, 0, 20},
                               {3, 34, 20, 28},
                               {4, 57, 20, 0},
                               {5, 63, 20, 28},
                               {6, 30, 22, 0},
                               {7, 36, 22, 30},
                               {8, 38, 22, 30},
                               {9, 59, 22, 0},
                               {10, 67, 22, 30}};

struct LasFile {
  std::uint8_t minor = 2;
  Layout layout = kLayouts[0];
  double scale = 0.01;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  std::vector<LasPoint> points;
  std::string records;  // of variable length
  std::uint32_t record_count = 0;
  std::uint16_t extra_bytes = 0;
};

void PutPoint(const LasFile& file, const LasPoint& point, std::size_t at, std::string& bytes) {
  const Layout& layout = file.layout;
  PutAt(bytes, at, point.x);
  PutAt(bytes, at + 4, point.y);
  PutAt(bytes, at + 8, point.z);
  PutAt(bytes, at + 12, point.intensity);
  if (layout.format >= 6) {
    PutAt<std::uint8_t>(bytes, at + 15, point.withheld ? 4 : 0);
    PutAt(bytes, at + 16, point.classification);
  } else {
    PutAt<std::uint8_t>(bytes, at + 15, point.classification | (point.withheld ? 128 : 0));
  }
  if (layout.time > 0) PutAt(bytes, at + layout.time, point.time);
  if (layout.red > 0) {
    PutAt(bytes, at + layout.red, point.red);
    PutAt(bytes, at + layout.red + 2, point.green);
    PutAt(bytes, at + layout.red + 4, point.blue);
  }
}

std::string BytesOf(const LasFile& file) {
  const std::uint16_t header = file.minor >= 4 ? 375 : file.minor == 3 ? 235 : 227;
  std::string bytes(header, '\0');
  std::memcpy(bytes.data(), "LASF", 4);
  PutAt<std::uint8_t>(bytes, 24, 1);
  PutAt(bytes, 25, file.minor);
  PutAt(bytes, 94, header);
  bytes += file.records;
  const std::size_t begin = bytes.size();
  PutAt(bytes, 96, static_cast<std::uint32_t>(begin));
  PutAt(bytes, 100, file.record_count);
  PutAt(bytes, 104, file.layout.format);
  const std::size_t step = file.layout.bytes + file.extra_bytes;
  PutAt(bytes, 105, static_cast<std::uint16_t>(step));
  if (file.minor < 4) PutAt(bytes, 107, static_cast<std::uint32_t>(file.points.size()));
  if (file.minor >= 4) PutAt(bytes, 247, static_cast<std::uint64_t>(file.points.size()));
  for (int k = 0; k < 3; ++k) {
    PutAt(bytes, 131 + 8 * static_cast<std::size_t>(k), file.scale);
    PutAt(bytes, 155 + 8 * static_cast<std::size_t>(k), file.offset[k]);
  }
  bytes.resize(begin + step * file.points.size());
  for (std::size_t i = 0; i < file.points.size(); ++i) {
    PutPoint(file, file.points[i], begin + step * i, bytes);
  }
  return bytes;
}

void AddRecord(const std::string& user, std::uint16_t id, const std::string& data, LasFile& file) {
  std::string record(54, '\0');
  std::memcpy(record.data() + 2, user.data(), user.size());
  PutAt(record, 18, id);
  PutAt(record, 20, static_cast<std::uint16_t>(data.size()));
  file.records += record + data;
  ++file.record_count;
}

// GeoTIFF keys that hold their values themselves.
std::string Keys(const std::vector<std::pair<std::uint16_t, std::uint16_t>>& keys) {
  std::string bytes;
  for (const std::size_t word : {std::size_t{1}, std::size_t{1}, std::size_t{0}, keys.size()}) {
    PutAt(bytes, bytes.size(), static_cast<std::uint16_t>(word));
  }
  for (const auto& [key, value] : keys) {
    for (const std::uint16_t word : {key, std::uint16_t{0}, std::uint16_t{1}, value}) {
      PutAt(bytes, bytes.size(), word);
    }
  }
  return bytes;
}

LasFile TwoPoints() {
  LasFile file;
  file.points = {{100, 200, 300, 7, 2, false, 1.5, 65535, 0, 32768},
                 {-100, 0, 50, 9, 6, false, 2.5, 0, 65535, 0}};
  return file;
}

TEST(LasReaderTest, EveryFormatGivesWhatItHolds) {
  for (const Layout& layout : kLayouts) {
    for (const std::uint16_t extra : {0, 3}) {
      SCOPED_TRACE(static_cast<int>(layout.format));
      LasFile file = TwoPoints();
      file.layout = layout;
      file.minor = layout.format >= 6 ? 4 : layout.format >= 4 ? 3 : 2;
      file.extra_bytes = extra;
      STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadLas(BytesOf(file)));
      EXPECT_THAT(cloud.points, ElementsAre(Eigen::Vector3f(1, 2, 3), Eigen::Vector3f(-1, 0, 0.5)));
      EXPECT_THAT(cloud.intensity, ElementsAre(7, 9));
      EXPECT_THAT(cloud.label, ElementsAre(2, 6));
      const std::vector<double> times = {1.5, 2.5};
      EXPECT_EQ(cloud.time, layout.time > 0 ? times : std::vector<double>());
      const std::vector<Colour> colours = {{255, 0, 128}, {0, 255, 0}};
      EXPECT_EQ(cloud.colour, layout.red > 0 ? colours : std::vector<Colour>());
    }
  }
}

TEST(LasReaderTest, UtmKeepsItsMillimetres) {
  LasFile file = TwoPoints();
  file.scale = 0.001;
  file.offset = Eigen::Vector3d(448'000, 5'411'000, 0);
  file.points = {{123'457, 7, 291'003}, {123'458, 9, 291'001}};
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadLas(BytesOf(file)));
  ASSERT_EQ(cloud.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const Eigen::Vector3d truth(448'000 + 0.001 * file.points[i].x,
                                5'411'000 + 0.001 * file.points[i].y,
                                0.001 * file.points[i].z);
    EXPECT_LT((cloud.origin + cloud.points[i].cast<double>() - truth).norm(), 1e-4);
  }
}

TEST(LasReaderTest, WhatIsZeroThroughoutIsNotThere) {
  LasFile file;
  file.layout = kLayouts[3];
  file.points = {{1, 2, 3}, {4, 5, 6}};
  file.points[1].classification = 1;  // unclassified
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadLas(BytesOf(file)));
  EXPECT_TRUE(cloud.intensity.empty());
  EXPECT_TRUE(cloud.label.empty());
  EXPECT_TRUE(cloud.colour.empty());
  EXPECT_TRUE(cloud.time.empty());
}

TEST(LasReaderTest, WithheldPointsAreLeftOut) {
  for (const std::size_t format : {0U, 6U}) {
    LasFile file = TwoPoints();
    file.layout = kLayouts[format];
    file.minor = 4;
    file.points[0].withheld = true;
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadLas(BytesOf(file)));
    EXPECT_THAT(cloud.points, ElementsAre(Eigen::Vector3f(-1, 0, 0.5)));
    EXPECT_THAT(cloud.label, ElementsAre(6));
  }
}

TEST(LasReaderTest, FeetBecomeMetres) {
  LasFile keys = TwoPoints();
  AddRecord("LASF_Projection", 34735, Keys({{1024, 1}, {3076, 9002}, {4099, 9001}}), keys);
  STRATA_ASSERT_OK_AND_ASSIGN(PointCloud cloud, ReadLas(BytesOf(keys)));
  EXPECT_TRUE(cloud.points[0].isApprox(Eigen::Vector3f(0.3048F, 0.6096F, 3.0F)));
  LasFile text = TwoPoints();
  AddRecord("LASF_Projection",
            2112,
            "PROJCS[\"p\",GEOGCS[\"g\",UNIT[\"degree\",0.0174]],UNIT[\"foot\",0.3048]]",
            text);
  STRATA_ASSERT_OK_AND_ASSIGN(cloud, ReadLas(BytesOf(text)));
  EXPECT_TRUE(cloud.points[0].isApprox(Eigen::Vector3f(0.3048F, 0.6096F, 0.9144F)));
}

TEST(LasUnitsTest, TextsOfBothGenerations) {
  const WktUnits first = UnitsOfWkt(
      "COMPD_CS[\"c\",PROJCS[\"UNIT[\",GEOGCS[\"g\",DATUM[\"d\",SPHEROID[\"s\",6378137,298]],UNIT["
      "\"degree\",0.01745]],PARAMETER[\"false_easting\",5],UNIT[\"US survey foot\",0.3048006096]],"
      "VERT_CS[\"v\",VERT_DATUM[\"w\",2005],UNIT[\"metre\",1.0]]]");
  EXPECT_FALSE(first.geographic);
  EXPECT_EQ(first.horizontal_m, 0.3048006096);
  EXPECT_EQ(first.vertical_m, 1.0);
  const WktUnits second = UnitsOfWkt(
      "PROJCRS[\"p\",BASEGEOGCRS[\"g\",DATUM[\"d\",ELLIPSOID[\"e\",6378137,298,LENGTHUNIT["
      "\"metre\","
      "1]]]],CONVERSION[\"c\",PARAMETER[\"x\",5,LENGTHUNIT[\"metre\",1]]],CS[Cartesian,2],AXIS["
      "\"east\",east,LENGTHUNIT[\"foot\",0.3048]]]");
  EXPECT_FALSE(second.geographic);
  EXPECT_EQ(second.horizontal_m, 0.3048);
  EXPECT_TRUE(UnitsOfWkt("GEOGCS[\"g\",UNIT[\"degree\",0.01745]]").geographic);
  EXPECT_FALSE(UnitsOfWkt("''").geographic);
  EXPECT_EQ(UnitsOfWkt("PROJCS[\"p\",UNIT[\"foot").horizontal_m, std::nullopt);
}

TEST(LasReaderTest, RefusalsSayWhatToDo) {
  const auto expect = [](const std::string& bytes, const std::string& message) {
    EXPECT_THAT(ReadLas(bytes), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  const std::string good = BytesOf(TwoPoints());
  expect("", "expected 'LASF'");
  expect(good.substr(0, 100), "expected a header");
  expect(good.substr(0, good.size() - 1), "the file is cut short");
  std::string changed = good;
  changed[104] = 11;
  expect(changed, "point record format 11; 0 to 10");
  changed = good;
  changed[25] = 5;
  expect(changed, "version 1.5");
  changed = good;
  PutAt(changed, 131, 0.0);
  expect(changed, "no scale of 0");
  changed = good;
  PutAt<std::uint16_t>(changed, 105, 19);
  expect(changed, "need 20");
  LasFile degrees = TwoPoints();
  AddRecord("LASF_Projection", 34735, Keys({{1024, 2}}), degrees);
  expect(BytesOf(degrees), "degrees");
  LasFile chains = TwoPoints();
  AddRecord("LASF_Projection", 34735, Keys({{3076, 9097}}), chains);
  expect(BytesOf(chains), "EPSG 9097");
  LasFile empty;
  expect(BytesOf(empty), "no finite point among 0");
}

TEST(LasReaderTest, DamageIsAStatus) {
  LasFile file = TwoPoints();
  AddRecord("LASF_Projection", 34735, Keys({{1024, 1}, {3076, 9002}}), file);
  AddRecord("LASF_Projection", 2112, "PROJCS[\"p\",UNIT[\"foot\",0.3048]]", file);
  testing::ExpectSoundOnDamage(BytesOf(file), &ReadLas, 1);
  file.minor = 4;
  file.layout = kLayouts[7];
  testing::ExpectSoundOnDamage(BytesOf(file), &ReadLas, 2);
}

struct Sample {
  const char* name;
  std::size_t points;
  double horizontal_m, vertical_m;
};

TEST(LasReaderTest, RecordedSurveysLieInTheBoxesOfTheirHeaders) {
  STRATA_REQUIRE_DATA(path, "importer_samples");
  constexpr double kUsFoot = 1200.0 / 3937.0;
  for (const Sample& sample : {Sample{"pdal_autzen_trim.las", 110'000, 0.3048, 0.3048},
                               Sample{"pdal_interesting.las", 1'065, 0.3048, 0.3048},
                               Sample{"pdal_mvk-thin.las", 6'280, kUsFoot, kUsFoot},
                               Sample{"pdal_warsaw_small.las", 3'000, 1.0, 1.0},
                               Sample{"urban.las", 13'511, 1.0, 1.0},
                               Sample{"pdal_autzen_trim.laz", 110'000, 0.3048, 0.3048},
                               Sample{"lidR_Megaplot.laz", 81'590, 1.0, 1.0},
                               Sample{"lidR_Topography.laz", 73'403, 1.0, 1.0}}) {
    SCOPED_TRACE(sample.name);
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScan(path / sample.name));
    EXPECT_EQ(cloud.size(), sample.points);
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3f& p : cloud.points) box.extend(cloud.origin + p.cast<double>());
    std::ifstream file(path / sample.name, std::ios::binary);
    file.seekg(179);
    double bounds[6];  // max x, min x, max y, …
    file.read(reinterpret_cast<char*>(bounds), sizeof bounds);
    for (int k = 0; k < 3; ++k) {
      const double unit_m = k < 2 ? sample.horizontal_m : sample.vertical_m;
      EXPECT_NEAR(box.max()[k], bounds[2 * k] * unit_m, 2e-3) << k;
      EXPECT_NEAR(box.min()[k], bounds[2 * k + 1] * unit_m, 2e-3) << k;
    }
  }
}

}  // namespace
}  // namespace strata
