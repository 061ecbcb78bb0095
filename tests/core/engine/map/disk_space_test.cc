#include "core/engine/map/disk_space.h"

#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/statvfs.h>

#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace {

struct Disk {
  bool says = true;
  std::uint64_t bytes = 0;
  std::uint64_t free = 0;
};
Disk disk;  // what the system says of all disks in this program
constexpr std::uint64_t kBlock = 4096;

}  // namespace

// In place of the C library's.
extern "C" int statvfs(const char* /*file*/, struct statvfs* found) noexcept {
  if (!disk.says) {
    errno = EACCES;
    return -1;
  }
  *found = {};
  found->f_frsize = kBlock;
  found->f_blocks = disk.bytes / kBlock;
  found->f_bfree = disk.bytes / kBlock;  // with what only root gets
  found->f_bavail = disk.free / kBlock;
  return 0;
}

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::strata::testing::TempDir;
using ::testing::HasSubstr;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

class DiskSpaceTest : public ::testing::Test {
 protected:
  const DiskSpace space_{"maps/world.strata"};
};

TEST_F(DiskSpaceTest, UploadsLeave64MebibytesAndIntegrationHalfOfThat) {
  disk = {.bytes = 1000 * kMiB, .free = 64 * kMiB};
  STRATA_EXPECT_OK(space_.CheckForUpload());
  disk.free -= kBlock;
  EXPECT_THAT(space_.CheckForUpload(),
              StatusIs(absl::StatusCode::kResourceExhausted,
                       HasSubstr("63 MiB free, of which the last 64 MiB are kept")));
  STRATA_EXPECT_OK(space_.CheckForIntegration(0));
  disk.free = 32 * kMiB;
  STRATA_EXPECT_OK(space_.CheckForIntegration(0));
  disk.free -= kBlock;
  EXPECT_THAT(space_.CheckForIntegration(0),
              StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("31 MiB free")));
}

TEST_F(DiskSpaceTest, IntegrationLeavesItAfterItsOwnRowsInTheLogAndInTheMap) {
  disk = {.bytes = 1000 * kMiB, .free = 42 * kMiB};
  STRATA_EXPECT_OK(space_.CheckForIntegration(5 * kMiB));
  EXPECT_THAT(space_.CheckForIntegration(5 * kMiB + kBlock),
              StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("up to 11 MiB would be")));
}

TEST_F(DiskSpaceTest, WhatTheLogHoldsIsTakenAlready) {
  const TempDir directory;
  const std::filesystem::path file = directory.path() / "world.strata";
  std::ofstream(file.string() + "-wal").close();
  std::filesystem::resize_file(file.string() + "-wal", 5 * kMiB);
  const DiskSpace space(file);
  disk = {.bytes = 1000 * kMiB, .free = 69 * kMiB};
  STRATA_EXPECT_OK(space.CheckForUpload());
  disk.free -= kBlock;
  EXPECT_FALSE(space.CheckForUpload().ok());
  disk.free = 37 * kMiB;
  STRATA_EXPECT_OK(space.CheckForIntegration(0));
  EXPECT_FALSE(space.CheckForIntegration(1).ok());
}

TEST_F(DiskSpaceTest, WhatCouldBeDoneWithoutLeavesTwiceThat) {
  disk = {.bytes = 1000 * kMiB, .free = 128 * kMiB};
  STRATA_EXPECT_OK(space_.CheckForKeeping(0));
  disk.free -= kBlock;
  EXPECT_THAT(space_.CheckForKeeping(0),
              StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("127 MiB free")));
  STRATA_EXPECT_OK(space_.CheckForUpload());
}

TEST_F(DiskSpaceTest, OfASmallDiskAQuarterIsLeft) {
  disk = {.bytes = 40 * kMiB, .free = 10 * kMiB};
  STRATA_EXPECT_OK(space_.CheckForUpload());
  disk.free -= kBlock;
  EXPECT_FALSE(space_.CheckForUpload().ok());
  STRATA_EXPECT_OK(space_.CheckForIntegration(0));
  disk.free = 5 * kMiB - kBlock;
  EXPECT_FALSE(space_.CheckForIntegration(0).ok());
}

TEST_F(DiskSpaceTest, ADiskThatDoesNotSayIsTakenForOneWithRoom) {
  disk = {.says = false};
  STRATA_EXPECT_OK(space_.CheckForUpload());
  STRATA_EXPECT_OK(space_.CheckForIntegration(0));
}

}  // namespace
}  // namespace strata
