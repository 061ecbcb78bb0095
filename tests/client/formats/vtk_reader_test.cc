#include "client/formats/vtk_reader.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/formats/hostile_files.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kStart[] = "# vtk DataFile Version 3.0\na title\n";

TEST(VtkReaderTest, AsciiPointsMayBreakTheirLinesAnywhere) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const PointCloud cloud,
      ReadVtk(std::string(kStart) +
              "ASCII\nDATASET POLYDATA\nPOINTS 2 float\n1 2 3 4\n5\n6\nVERTICES 2 4\n1 0 1 1\n"));
  EXPECT_THAT(cloud.points, ElementsAre(Eigen::Vector3f(1, 2, 3), Eigen::Vector3f(4, 5, 6)));
}

TEST(VtkReaderTest, BinaryPointsAreBigEndian) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const PointCloud cloud,
      ReadVtk(std::string(kStart) + "BINARY\nDATASET POLYDATA\nPOINTS 2 short\n" +
              std::string("\1\0\377\377\0\1\377\0\377\377\0\1\n", 13)));
  EXPECT_THAT(cloud.points, ElementsAre(Eigen::Vector3f(256, -1, 1), Eigen::Vector3f(-256, -1, 1)));
}

TEST(VtkReaderTest, ErrorsNameTheLineAndWhatWasExpected) {
  const auto expect = [](const std::string& file, const std::string& message) {
    EXPECT_THAT(ReadVtk(file), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  expect("", "expected '# vtk DataFile Version'");
  expect(std::string(kStart) + "XML\n", "line 3: expected ASCII or BINARY");
  expect(std::string(kStart) + "ASCII\nDATASET POLYDATA\n", "expected a section POINTS");
  expect(std::string(kStart) + "ASCII\nPOINTS 5000000000 float\n1 2 3\n", "do not fit");
  expect(std::string(kStart) + "ASCII\nPOINTS 2 float\n1 2 3\n1 2 c\n",
         "line 6: expected 2 points");
}

TEST(VtkReaderTest, DamageIsAStatus) {
  testing::ExpectSoundOnDamage(
      std::string(kStart) + "ASCII\nDATASET POLYDATA\nPOINTS 2 float\n1 2 3 4\n5\n6\n",
      &ReadVtk,
      1);
}

}  // namespace
}  // namespace strata
