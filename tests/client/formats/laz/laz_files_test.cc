// LAZ files: what another program packed becomes what it was, and what is damaged, or packed in a
// way that is not read, is refused.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "client/formats/scan_reader.h"
#include "client/formats/survey/las_reader.h"
#include "core/cloud/point_cloud.h"
#include "tests/client/formats/hostile_files.h"
#include "tests/client/formats/laz/laz_records.h"
#include "tests/support/data_dir.h"
#include "tests/support/paths.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

using ::strata::testing::PutAt;
using ::strata::testing::RecordsOfLaz;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

// packed/README.md says how they were made.
constexpr std::array kPacked = {"first_format3_extra",
                                "first_format5_chunks",
                                "format0",
                                "format1",
                                "format2",
                                "format3_extra",
                                "format4",
                                "format6_extra_channels",
                                "format7",
                                "format7_chunks_vary",
                                "format8_extra_channels",
                                "version4_format8_extra_channels"};
constexpr std::size_t kPackedPoints = 200;

fs::path PackedFile(const std::string& name) {
  return fs::path(testing::SourcePath("tests/client/formats/laz/packed")) / name;
}

std::string Packed(const std::string& name) { return ReadFileBytes(PackedFile(name)).value(); }

// Of an uncompressed file, whose points are the last it has.
std::string RecordsOfLas(const std::string& file) {
  std::uint32_t at = 0;
  std::memcpy(&at, file.data() + 96, sizeof at);
  return file.substr(at);
}

// Where in a file the record is that says how points are packed.
std::size_t LazRecordAt(const std::string& file) { return file.find("laszip encoded") + 52; }

void ExpectSame(const PointCloud& a, const PointCloud& b) {
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.origin, b.origin);
  EXPECT_EQ(a.intensity, b.intensity);
  EXPECT_EQ(a.colour, b.colour);
  EXPECT_EQ(a.label, b.label);
  EXPECT_EQ(a.time, b.time);
}

TEST(LazFilesTest, WhatWasPackedComesOut) {
  for (const std::string name : kPacked) {
    SCOPED_TRACE(name);
    const std::string packed = Packed(name + ".laz");
    const std::string plain = Packed(name + ".las");
    STRATA_ASSERT_OK_AND_ASSIGN(const std::string records, RecordsOfLaz(packed));
    EXPECT_TRUE(records == RecordsOfLas(plain));
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadLas(packed));
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud twin, ReadLas(plain));
    EXPECT_GT(cloud.size(), kPackedPoints / 2);  // the others are withheld
    ExpectSame(cloud, twin);
  }
}

TEST(LazFilesTest, AFileIsReadAsItsBytesAre) {
  for (const std::string name : {"format3_extra.laz", "format7_chunks_vary.laz", "format1.las"}) {
    SCOPED_TRACE(name);
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud file, ReadScan(PackedFile(name)));
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud bytes, ReadLas(Packed(name)));
    ExpectSame(file, bytes);
  }
}

TEST(LazFilesTest, WhatIsPackedOtherwiseIsRefusedByName) {
  const auto expect = [](std::size_t at, std::uint16_t value, const std::string& message) {
    std::string packed = Packed("format3_extra.laz");
    PutAt(packed, LazRecordAt(packed) + at, value);
    EXPECT_THAT(ReadLas(packed), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  expect(0, 4, "compressor 4; 1 (no chunks), 2 (chunks) and 3 (layers) are read; 'laszip -i");
  expect(2, 7, "coder 7; 0 (arithmetic) is read");
  expect(
      38, 3, "POINT10 is packed by version 3 of its coder; versions 1 and 2 are read; 'laszip -i");
  expect(44, 7, "GPSTIME11 is packed by version 7");
  expect(32, 3, "do not make the points of 37 bytes and record format 3");
  expect(42, 9, "the item GPSTIME11 has 9 bytes; expected 8");
  expect(40, 5, "an item of type 5, which is not read");
  expect(32, 900, "is cut short");  // items
  std::string without = Packed("format0.laz");
  without[LazRecordAt(without) - 52] = 'x';
  EXPECT_THAT(
      ReadLas(without),
      StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("no record 'laszip encoded' 22204")));
}

TEST(LazFilesTest, WhatDoesNotFitIsRefused) {
  const std::string packed = Packed("format1.laz");
  std::uint32_t points_at = 0;
  std::memcpy(&points_at, packed.data() + 96, sizeof points_at);
  std::uint64_t table_at = 0;
  std::memcpy(&table_at, packed.data() + points_at, sizeof table_at);
  const auto expect = [](const std::string& bytes, const std::string& message) {
    EXPECT_THAT(ReadLas(bytes), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  std::string changed = packed;
  PutAt<std::uint32_t>(changed, 107, 1000);
  expect(changed, "3 chunks of 240 points; the header says 1000");
  changed = packed;
  PutAt<std::uint64_t>(changed, points_at, packed.size());
  expect(changed, "no place of a chunk table within the file");
  changed = packed;
  PutAt<std::uint32_t>(changed, table_at + 4, 1'000'000);
  expect(changed, "1000000 chunks; there is room for");
  changed = packed;
  PutAt<std::uint32_t>(changed, table_at, 1);
  expect(changed, "chunk table of version 1; 0 is read");
  expect(packed.substr(0, table_at + 8), "the chunk table is cut short");
  changed = packed;
  PutAt<std::uint32_t>(changed, 107, 4'000'000'000);
  PutAt<std::uint32_t>(changed, LazRecordAt(packed) + 12, 4'000'000'000);
  expect(changed, "at most 200 a byte are read");
  changed = packed;
  std::fill(changed.begin() + points_at + 36, changed.begin() + points_at + 400, '\xFF');
  expect(changed, "a chunk has fewer bytes than its points need");
}

TEST(LazFilesTest, ATableThatWasWrittenLastIsFoundAtTheEnd) {
  std::string packed = Packed("format0.laz");
  std::uint32_t points_at = 0;
  std::memcpy(&points_at, packed.data() + 96, sizeof points_at);
  packed += packed.substr(points_at, 8);
  PutAt<std::int64_t>(packed, points_at, -1);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string records, RecordsOfLaz(packed));
  EXPECT_TRUE(records == RecordsOfLas(Packed("format0.las")));
}

TEST(LazFilesTest, DamageIsAStatus) {
  std::uint64_t seed = 1;
  for (const char* name :
       {"first_format5_chunks.laz", "format3_extra.laz", "format8_extra_channels.laz"}) {
    SCOPED_TRACE(name);
    testing::ExpectSoundOnDamage(Packed(name), &ReadLas, seed++);
  }
}

TEST(LazFilesTest, ARecordedFileIsItsTwin) {
  STRATA_REQUIRE_DATA(path, "importer_samples");
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string packed,
                              ReadFileBytes(path / "pdal_autzen_trim.laz"));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string plain,
                              ReadFileBytes(path / "pdal_autzen_trim.las"));
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string records, RecordsOfLaz(packed));
  EXPECT_TRUE(records == RecordsOfLas(plain));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScan(path / "pdal_autzen_trim.laz"));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud twin, ReadScan(path / "pdal_autzen_trim.las"));
  EXPECT_EQ(cloud.size(), 110'000U);
  ExpectSame(cloud, twin);
}

}  // namespace
}  // namespace strata
