// Copies of a map that is in use.
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/checksum.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/faults/faulty_disk.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using ::testing::_;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class EngineBackupTest : public EngineTest {
 protected:
  // Into another directory, as map "copy".
  absl::Status BackUp() {
    const std::filesystem::path file = other_.path() / "copy.strata";
    std::ofstream out(file, std::ios::binary);
    ContentHasher hasher;
    std::uint64_t received = 0;
    return db().maps().Backup({}, kMapName, [&](const api::BackupPiece& piece) {
      EXPECT_LE(piece.bytes.size(), 1U << 20);
      EXPECT_FALSE(piece.bytes.empty());
      hasher.Add(piece.bytes);
      out.write(piece.bytes.data(), static_cast<std::streamsize>(piece.bytes.size()));
      received += piece.bytes.size();
      const bool last = received == piece.total_bytes;
      EXPECT_EQ(piece.content_hash, last ? hasher.HexDigest() : "");
      return absl::OkStatus();
    });
  }
  std::unique_ptr<api::Database> OpenOther() const {
    EngineOptions options = Options();
    options.directory = other_.path();
    auto opened = OpenEngine(options);
    EXPECT_THAT(opened, IsOk());
    return opened.ok() ? *std::move(opened) : nullptr;
  }
  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path())) {
      names.push_back(entry.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }
  static std::set<ScanId> ScansOf(api::Database& database, const std::string& map) {
    std::set<ScanId> ids;
    STRATA_EXPECT_OK(database.scans().List({}, map, {}, [&](const ScanInfo& scan) {
      ids.insert(scan.header.id);
      return absl::OkStatus();
    }));
    return ids;
  }

  TempDir other_;
};

TEST_F(EngineBackupTest, ABackupWhileRobotsUploadIsAWholeMap) {
  MakeMap();
  UploadRooms(4);
  WaitIntegrated(db());
  STRATA_ASSERT_OK(db().posegraph().SetPose({}, kMapName, {"run", 2}, PoseAt(5.0, 5.0, 0.2)));
  std::atomic<bool> done = false;
  std::atomic<int> acknowledged = 0;
  std::vector<std::thread> robots;
  for (int robot = 0; robot < 4; ++robot) {
    robots.emplace_back([&, robot] {
      for (std::uint64_t i = 1; !done; ++i) {
        const PointCloud cloud = MakeRoom(100 * static_cast<std::uint64_t>(robot) + i);
        const ScanId id{"robot" + std::to_string(robot), i};
        const Pose T_map_scan = PoseAt(8.0 * robot, 6.0 * static_cast<double>(i));
        STRATA_EXPECT_OK(Upload(db(), HeaderOf(id, cloud, T_map_scan), cloud));
        ++acknowledged;
      }
    });
  }
  while (acknowledged < 8) std::this_thread::yield();
  const std::set<ScanId> before = ScansOf(db(), kMapName);
  STRATA_EXPECT_OK(BackUp());
  done = true;
  for (std::thread& robot : robots) robot.join();

  const std::unique_ptr<api::Database> other = OpenOther();
  ASSERT_NE(other, nullptr);
  const std::string digest = WaitIntegrated(*other, "copy").content_digest;
  const std::set<ScanId> copied = ScansOf(*other, "copy");
  const std::set<ScanId> all = ScansOf(db(), kMapName);
  EXPECT_TRUE(std::includes(copied.begin(), copied.end(), before.begin(), before.end()));
  EXPECT_TRUE(std::includes(all.begin(), all.end(), copied.begin(), copied.end()));
  const JobInfo verified = RunJob(*other, "verify", {}, "copy");
  EXPECT_EQ(verified.state, JobState::kSucceeded) << verified.message;
  EXPECT_EQ(RunJob(*other, "rebuild", {}, "copy").metrics.at("tiles_changed"), 0.0);
  EXPECT_EQ(WaitIntegrated(*other, "copy").content_digest, digest);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto epochs, other->maps().History({}, "copy"));
  EXPECT_EQ(epochs.size(), 2U);
}

TEST_F(EngineBackupTest, NothingIsLeftBehind) {
  MakeMap();
  UploadRooms(2);
  WaitIntegrated(db());
  const std::vector<std::string> before = Files();
  STRATA_EXPECT_OK(BackUp());
  EXPECT_EQ(Files(), before);
  // A second one at the same time is refused; an error of the sink ends the stream.
  const absl::Status ended = db().maps().Backup({}, kMapName, [&](const api::BackupPiece&) {
    EXPECT_THAT(BackUp(), StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("another")));
    return absl::AbortedError("enough");
  });
  EXPECT_THAT(ended, StatusIs(absl::StatusCode::kAborted, "enough"));
  EXPECT_EQ(Files(), before);
  const api::Call stopped;
  stopped.stop.Request();
  const auto nothing = [](const api::BackupPiece&) { return absl::OkStatus(); };
  EXPECT_THAT(db().maps().Backup(stopped, kMapName, nothing),
              StatusIs(absl::StatusCode::kCancelled, _));
  EXPECT_THAT(db().maps().Backup({}, "none", nothing), StatusIs(absl::StatusCode::kNotFound, _));
  EXPECT_EQ(Files(), before);
  STRATA_EXPECT_OK(BackUp());
  Close();
  // What a crash left is gone at the next start.
  std::ofstream(directory_.path() / ".copy-world.strata") << "half a copy";
  Reopen();
  Close();
  EXPECT_THAT(Files(), ElementsAre(".lock", "world.strata"));
}

// A page that is not read is no damage: nobody is told to mend the map.
TEST_F(EngineBackupTest, ADiskThatDoesNotReadIsUnavailable) {
  Close();
  FaultyDisk disk;
  Reopen();
  MakeMap();
  UploadRooms(2);
  WaitIntegrated(db());
  const std::int64_t before = disk.operations(DiskFault::kRead);
  STRATA_EXPECT_OK(BackUp());
  const std::int64_t reads = disk.operations(DiskFault::kRead) - before;
  int unavailable = 0;
  for (std::int64_t sound = 0; sound < reads; sound += 1 + reads / 40) {
    disk.Fail(DiskFault::kRead, sound);
    const absl::Status status = BackUp();
    disk.Mend();
    if (status.ok()) continue;
    EXPECT_THAT(status, StatusIs(absl::StatusCode::kUnavailable, _)) << "read " << sound;
    ++unavailable;
  }
  EXPECT_GT(unavailable, 0);
  STRATA_EXPECT_OK(BackUp());
  Close();
}

}  // namespace
}  // namespace strata::testing
