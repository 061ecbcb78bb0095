#include "client/formats/pcd_reader.h"

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/lzf.h"
#include "tests/client/formats/hostile_files.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::IsOkAndHolds;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

template <typename T>
std::string Bytes(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

std::string Header(const std::string& fields,
                   const std::string& sizes,
                   const std::string& types,
                   const std::string& width,
                   const std::string& rest) {
  return absl::StrCat("# .PCD v0.7\nVERSION 0.7\nFIELDS ",
                      fields,
                      "\nSIZE ",
                      sizes,
                      "\nTYPE ",
                      types,
                      "\nWIDTH ",
                      width,
                      "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n",
                      rest);
}

TEST(PcdReaderTest, AsciiWithColumnsInAnyOrder) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const PointCloud cloud,
      ReadPcd(Header("label z y x intensity rgb",
                     "2 4 4 4 4 4",
                     "U F F F F U",
                     "3",
                     "POINTS 3\nDATA ascii\n7 3 2 1 0.5 16909060\n8 nan 0 0 0 0\n"
                     "9 6 5 4 1.5 255\n")));
  ASSERT_EQ(cloud.size(), 2U);  // the point without a number is left out
  EXPECT_EQ(cloud.points[0], Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(cloud.points[1], Eigen::Vector3f(4, 5, 6));
  EXPECT_THAT(cloud.intensity, ::testing::ElementsAre(0.5F, 1.5F));
  EXPECT_THAT(cloud.label, ::testing::ElementsAre(7, 9));
  EXPECT_EQ(cloud.colour[0], (Colour{2, 3, 4}));
  EXPECT_EQ(cloud.colour[1], (Colour{0, 0, 255}));
  EXPECT_FALSE(cloud.organised());
}

TEST(PcdReaderTest, LabelsHaveAnyWholeNumbers) {
  for (const char* type : {"1 U", "1 I", "2 I", "4 U", "8 I", "4 F", "8 F"}) {
    SCOPED_TRACE(type);
    const std::string letter(1, type[2]);
    const std::string size(1, type[0]);
    const std::string file = Header("x y z label",
                                    "4 4 4 " + size,
                                    "F F F " + letter,
                                    "2",
                                    "POINTS 2\nDATA ascii\n0 0 0 100\n1 1 1 7\n");
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadPcd(file));
    EXPECT_THAT(cloud.label, ::testing::ElementsAre(100, 7));
  }
}

TEST(PcdReaderTest, OrganisedCloudsKeepTheirGridAndHoles) {
  const float nan = std::nanf("");
  STRATA_ASSERT_OK_AND_ASSIGN(
      const PointCloud cloud,
      ReadPcd(absl::StrCat(
          "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 2\n"
          "VIEWPOINT 1 2 3 1 0 0 0\nPOINTS 6\nDATA binary\n",
          Bytes<float>({0, 0, 1, nan, 5, 5, 2, 0, 1, 0, 1, 1, 1, 1, 1, 2, 1, 1}))));
  EXPECT_EQ(cloud.rows, 2U);
  EXPECT_EQ(cloud.columns, 3U);
  ASSERT_EQ(cloud.size(), 6U);
  EXPECT_TRUE(cloud.points[1].array().isNaN().all());
  EXPECT_EQ(cloud.points[5], Eigen::Vector3f(2, 1, 1));
  EXPECT_EQ(cloud.sensor_origin, Eigen::Vector3f(1, 2, 3));
}

TEST(PcdReaderTest, FarDoublesLoseNothing) {
  const std::vector<double> utm = {512345.678, 5412345.123, 251.25, 512346.679, 5412344.124, 250.5};
  STRATA_ASSERT_OK_AND_ASSIGN(
      const PointCloud cloud,
      ReadPcd(Header("X Y Z", "8 8 8", "F F F", "2", "POINTS 2\nDATA binary\n") + Bytes(utm)));
  EXPECT_EQ(cloud.origin, Eigen::Vector3d(512346, 5412345, 251));
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d p = cloud.origin + cloud.points[i].cast<double>();
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(p[k], utm[3 * i + k], 1e-5);
  }
  EXPECT_TRUE(cloud.sensor_origin.isZero());
}

// Four corners of a square of `size_m`, its centre at `centre`; where `viewpoint` says the sensor
// was.
PointCloud ReadSquare(const Eigen::Vector3d& centre, float size_m, const std::string& viewpoint) {
  std::vector<float> values;
  for (const float x : {-0.5F, 0.5F}) {
    for (const float y : {-0.5F, 0.5F}) {
      const Eigen::Vector3f p = centre.cast<float>() + size_m * Eigen::Vector3f(x, y, 0);
      values.insert(values.end(), p.data(), p.data() + 3);
    }
  }
  const auto cloud =
      ReadPcd(Header("x y z",
                     "4 4 4",
                     "F F F",
                     "4",
                     "VIEWPOINT " + viewpoint + " 1 0 0 0\nPOINTS 4\nDATA binary\n") +
              Bytes(values));
  STRATA_EXPECT_OK(cloud);
  return cloud.value_or(PointCloud());
}

TEST(PcdReaderTest, WhereNoSensorCanHaveStoodTheCentreIsTheOrigin) {
  const Eigen::Vector3d far(-890.3, -943.0, 27.4);
  const PointCloud cloud = ReadSquare(far, 30.0F, "0 0 0");
  EXPECT_EQ(cloud.origin, Eigen::Vector3d(-890, -943, 27));
  EXPECT_TRUE(cloud.sensor_origin.isZero());
  EXPECT_TRUE((cloud.origin + cloud.points[3].cast<double>())
                  .isApprox(far + Eigen::Vector3d(15, 15, 0), 1e-6));
  // A sensor at zero may see what is large or near; a sensor that is named stood where it says.
  EXPECT_TRUE(ReadSquare(far, 1500.0F, "0 0 0").origin.isZero());
  EXPECT_TRUE(ReadSquare({60, 60, 0}, 0.5F, "0 0 0").origin.isZero());
  EXPECT_EQ(ReadSquare({0, 120, 0}, 4.0F, "0 0 0").origin, Eigen::Vector3d(0, 120, 0));
  const PointCloud named = ReadSquare({0, 120, 0}, 4.0F, "0 1 0");
  EXPECT_TRUE(named.origin.isZero());
  EXPECT_EQ(named.sensor_origin, Eigen::Vector3f(0, 1, 0));
}

TEST(PcdReaderTest, CompressedFieldsComeOneAfterTheOther) {
  // 2 points of x y z: literals only, then the same with a copy of a run of zeros.
  const std::string plain = Bytes<float>({1, 4, 2, 5, 0, 0});
  std::string packed;
  packed.push_back(static_cast<char>(16));  // 17 literals
  packed += plain.substr(0, 17);
  packed.push_back(static_cast<char>(5 << 5));  // 7 bytes from 1 back
  packed.push_back('\0');
  const std::vector<std::uint32_t> sizes = {static_cast<std::uint32_t>(packed.size()), 24};
  STRATA_ASSERT_OK_AND_ASSIGN(
      const PointCloud cloud,
      ReadPcd(Header("x y z", "4 4 4", "F F F", "2", "POINTS 2\nDATA binary_compressed\n") +
              Bytes(sizes) + packed));
  EXPECT_EQ(cloud.points[0], Eigen::Vector3f(1, 2, 0));
  EXPECT_EQ(cloud.points[1], Eigen::Vector3f(4, 5, 0));
}

TEST(PcdReaderTest, FieldsOfSeveralValuesAreSteppedOver) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const PointCloud cloud,
      ReadPcd("FIELDS _ x h y z\nSIZE 1 4 4 4 4\nTYPE U F F F F\nCOUNT 3 1 2 1 1\nWIDTH 1\n"
              "HEIGHT 1\nPOINTS 1\nDATA ascii\n0 0 0 1 9 9 2 3\n"));
  EXPECT_EQ(cloud.points[0], Eigen::Vector3f(1, 2, 3));
}

TEST(PcdReaderTest, ErrorsNameLineOrByteAndWhatWasExpected) {
  const auto expect = [](const std::string& file, const std::string& message) {
    EXPECT_THAT(ReadPcd(file), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  expect("", "expected a DATA line");
  expect("FIELDS x y z\nbanana 3\n", "line 2: expected a PCD header entry, found 'banana'");
  expect(Header("x y", "4 4", "F F", "1", "DATA ascii\n1 2\n"), "no field z");
  expect(Header("x y z", "4 4 4", "F F Q", "1", "DATA ascii\n1 2 3\n"),
         "field z has no known type");
  expect(Header("x y z", "4 4", "F F F", "1", "DATA ascii\n"), "3, 2, 3 and 3 entries");
  expect(Header("x y z", "4 4 4", "F F F", "2", "POINTS 3\nDATA ascii\n"), "POINTS is 3");
  expect(Header("x y z", "4 4 4", "F F F", "2", "DATA ascii\n1 2 3\n"),
         "expected 2 points, found 1");
  expect(Header("x y z", "4 4 4", "F F F", "1", "DATA ascii\n1 2\n"),
         "line 10: expected 3 numbers");
  expect(Header("x y z", "4 4 4", "F F F", "1", "DATA ascii\n1 2 z\n"),
         "field z is no number: 'z'");
  expect(Header("x y z", "4 4 4", "F F F", "4000000000", "DATA binary\n123"), "4000000000 points");
  expect(Header("x y z", "4 4 4", "F F F", "1", "DATA zip\n"), "found 'zip'");
  expect(Header("x y z", "4 4 4", "F F F", "1", "DATA ascii\nnan nan nan\n"), "no finite point");
  expect(Header("x y z",
                "4 4 4",
                "F F F",
                "300000000",
                "DATA binary_compressed\n" + Bytes<std::uint32_t>({3, 3600000000U}) + "abc"),
         "cannot hold");
}

TEST(PcdReaderTest, DamageIsAStatus) {
  const std::string ascii =
      Header("x y z rgb", "4 4 4 4", "F F F U", "2", "POINTS 2\nDATA ascii\n1 2 3 4\n5 6 7 8\n");
  testing::ExpectSoundOnDamage(ascii, &ReadPcd, 1);
  const std::string binary = Header("x y z", "4 4 4", "F F F", "2", "POINTS 2\nDATA binary\n") +
                             Bytes<float>({1, 2, 3, 4, 5, 6});
  testing::ExpectSoundOnDamage(binary, &ReadPcd, 2);
  std::string compressed =
      Header("x y z", "4 4 4", "F F F", "2", "POINTS 2\nDATA binary_compressed\n") +
      Bytes<std::uint32_t>({25, 24}) + '\x17' + Bytes<float>({1, 2, 3, 4, 5, 6});
  STRATA_ASSERT_OK(ReadPcd(compressed));
  testing::ExpectSoundOnDamage(compressed, &ReadPcd, 3);
}

TEST(LzfTest, CopiesMayOverlapThemselves) {
  EXPECT_THAT(DecompressLzf(std::string("\0a\xE0\x02\0", 5), 12), IsOkAndHolds("aaaaaaaaaaaa"));
  EXPECT_THAT(DecompressLzf(std::string("\0a\xE0\x02\1", 5), 12),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("12 bytes announced")));
}

}  // namespace
}  // namespace strata
