#include "client/formats/ply_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/hostile_files.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Another element before, a list between the properties, coordinates in three types.
constexpr char kHeader[] =
    "comment of all kinds\nelement camera 1\nproperty list uchar short k\nelement vertex 2\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty double z\n"
    "property list uchar uchar tags\nproperty short y\nproperty float x\nproperty int label\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";

void ExpectTheTwoPoints(const absl::StatusOr<PointCloud>& cloud) {
  STRATA_ASSERT_OK(cloud);
  EXPECT_THAT(cloud->points,
              ElementsAre(Eigen::Vector3f(1.5F, -2, 3), Eigen::Vector3f(4, 5, 6.25F)));
  EXPECT_THAT(cloud->colour, ElementsAre(Colour{10, 20, 30}, Colour{255, 0, 1}));
  EXPECT_THAT(cloud->label, ElementsAre(0, 300));  // -1 stands for none
}

std::string Ascii() {
  return std::string("ply\nformat ascii 1.0\n") + kHeader +
         "2 7 8\n10 20 30 3 2 1 1 -2 1.5 -1\n255 0 1 6.25 0 5 4 300\n3 0 1 0\n";
}

std::string LittleEndian() {
  return std::string("ply\r\nformat binary_little_endian 1.0\n") + kHeader +
         std::string("\2\7\0\10\0", 5) +
         std::string("\12\24\36\0\0\0\0\0\0\10\100\2\1\1\376\377\0\0\300\77\377\377\377\377", 24) +
         std::string("\377\0\1\0\0\0\0\0\0\31\100\0\5\0\0\0\200\100\54\1\0\0", 22);
}

std::string BigEndian() {
  return std::string("ply\nformat binary_big_endian 1.0\n") + kHeader +
         std::string("\2\0\7\0\10", 5) +
         std::string("\12\24\36\100\10\0\0\0\0\0\0\2\1\1\377\376\77\300\0\0\377\377\377\377", 24) +
         std::string("\377\0\1\100\31\0\0\0\0\0\0\0\0\5\100\200\0\0\0\0\1\54", 22);
}

TEST(PlyReaderTest, EveryEncodingWithAnyPropertiesGivesTheSamePoints) {
  ExpectTheTwoPoints(ReadPly(Ascii()));
  ExpectTheTwoPoints(ReadPly(LittleEndian()));
  ExpectTheTwoPoints(ReadPly(BigEndian()));
}

// Vertices that are all of one size, as most programs write them, behind another element.
std::string OneSize(bool big_endian) {
  std::string file = absl::StrCat("ply\nformat binary_",
                                  big_endian ? "big" : "little",
                                  "_endian 1.0\nelement camera 1\nproperty uchar a\n"
                                  "element vertex 2\nproperty float x\nproperty float y\n"
                                  "property float z\nproperty uchar label\nend_header\nc");
  for (const Eigen::Vector3f& point : {Eigen::Vector3f(1.5F, -2, 3), Eigen::Vector3f(4, 5, 6)}) {
    for (const float value : point) {
      auto bytes = std::bit_cast<std::array<char, 4>>(value);
      if (big_endian != (std::endian::native == std::endian::big)) {
        std::reverse(bytes.begin(), bytes.end());
      }
      file.append(bytes.data(), bytes.size());
    }
    file += '\7';
  }
  return file;
}

TEST(PlyReaderTest, VerticesOfOneSizeReadInBothByteOrders) {
  for (const bool big_endian : {false, true}) {
    const std::string file = OneSize(big_endian);
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadPly(file));
    EXPECT_THAT(cloud.points, ElementsAre(Eigen::Vector3f(1.5F, -2, 3), Eigen::Vector3f(4, 5, 6)));
    EXPECT_THAT(cloud.label, ElementsAre(7, 7));
    // One byte too few, which the announced number alone does not tell.
    EXPECT_THAT(ReadPly(file.substr(0, file.size() - 1)),
                StatusIs(absl::StatusCode::kInvalidArgument,
                         HasSubstr(absl::StrCat("byte ", file.size() - 1, ": expected more"))));
    testing::ExpectSoundOnDamage(file, &ReadPly, 4);
  }
}

TEST(PlyReaderTest, ColoursWithFractionsAreScaled) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const PointCloud cloud,
      ReadPly("ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
              "property float z\nproperty float red\nproperty float green\nproperty float blue\n"
              "end_header\n0 0 0 0.5 1 0\n1 1 1 0 0.2 1\n"));
  EXPECT_THAT(cloud.colour, ElementsAre(Colour{128, 255, 0}, Colour{0, 51, 255}));
}

// Two points with a label of some name and type.
std::string Labelled(const std::string& property, const std::string& first) {
  return "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
         "property float z\nproperty " +
         property + "\nend_header\n0 0 0 " + first + "\n1 1 1 7\n";
}

TEST(PlyReaderTest, LabelsHaveAnyWholeNumbersAndManyNames) {
  for (const char* property : {"uchar label",
                               "int class",
                               "ushort Classification",
                               "float scalar_Label",
                               "double scalar_Classification"}) {
    SCOPED_TRACE(property);
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadPly(Labelled(property, "12")));
    EXPECT_THAT(cloud.label, ElementsAre(12, 7));
  }
  for (const char* none : {"-1", "65536", "nan", "1e30"}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadPly(Labelled("float label", none)));
    EXPECT_THAT(cloud.label, ElementsAre(0, 7)) << none;
  }
  // A probability is no label.
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadPly(Labelled("float class", "0.25")));
  EXPECT_THAT(cloud.label, ::testing::IsEmpty());
  testing::ExpectSoundOnDamage(Labelled("float label", "12"), &ReadPly, 3);
}

TEST(PlyReaderTest, ErrorsNameLineOrByteAndWhatWasExpected) {
  const auto expect = [](const std::string& file, const std::string& message) {
    EXPECT_THAT(ReadPly(file), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  const std::string xyz = "property float x\nproperty float y\nproperty float z\nend_header\n";
  expect("plyx\n", "line 1: expected 'ply'");
  expect("ply\nformat ascii 1.0\nelement vertex -1\n", "line 3: expected 'element NAME COUNT'");
  expect("ply\nformat ascii 1.0\nelement face 0\nend_header\n", "no element vertex");
  expect("ply\nformat utf8 1.0\nelement vertex 0\n" + xyz, "format is none of");
  expect("ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\n", "unknown type");
  expect("ply\nformat binary_little_endian 1.0\nelement vertex 99999999999\n" + xyz,
         "99999999999 vertices do not fit");
  expect("ply\nformat ascii 1.0\nelement vertex 2\n" + xyz + "1 2 3\n4 5 seven\n",
         "line 9: expected a number, found 'seven'");
  expect("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
         "no field y");
}

TEST(PlyReaderTest, DamageIsAStatus) {
  testing::ExpectSoundOnDamage(Ascii(), &ReadPly, 1);
  testing::ExpectSoundOnDamage(LittleEndian(), &ReadPly, 2);
}

}  // namespace
}  // namespace strata
