// Uploads whose way breaks, whose server dies or whose sender dies arrive once and whole.
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <iostream>
#include <memory>
#include <random>
#include <string>
#include <thread>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "client/sdk/spool.h"
#include "core/cloud/cloud_slice.h"
#include "core/common/status.h"
#include "tests/integration/cutting_proxy.h"
#include "tests/integration/numbered_scans.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

constexpr char kMap[] = "world";
constexpr std::size_t kChunk = 10'000;
constexpr std::uint64_t kChunkBytes = kChunk * 12;

class ExactlyOnceTest : public ::testing::Test {
 protected:
  ExactlyOnceTest() { std::cout << "seed " << kSeed << "\n"; }

  std::unique_ptr<StratadProcess> Start(const std::string& listen = "127.0.0.1:0") const {
    return std::make_unique<StratadProcess>(std::vector<std::string>{
        "--data", (directory_.path() / "maps").string(), "--listen", listen});
  }
  static std::unique_ptr<api::Database> ConnectTo(const std::string& address) {
    ClientOptions options;
    options.target = address;
    options.backoff.initial = absl::Milliseconds(20);
    options.backoff.max_attempts = 20;
    auto client = Connect(options);
    EXPECT_THAT(client, IsOk());
    return client.ok() ? *std::move(client) : nullptr;
  }
  static absl::Status WriteUpTo(api::ScanUpload& upload, const PointCloud& cloud, std::size_t end) {
    for (std::size_t begin = upload.points_held(); begin < end; begin += kChunk) {
      STRATA_RETURN_IF_ERROR(upload.Write(SliceOf(cloud, begin, std::min(end, begin + kChunk))));
    }
    return absl::OkStatus();
  }
  static void ExpectStored(api::Database& db, std::uint64_t sequence, std::size_t points) {
    const PointCloud cloud = NumberedCloud(sequence, points);
    std::vector<Eigen::Vector3f> stored;
    STRATA_ASSERT_OK(db.scans().GetPoints({}, kMap, {"run", sequence}, [&](const auto& piece) {
      stored.insert(stored.end(), piece.points.begin(), piece.points.end());
      return absl::OkStatus();
    }));
    EXPECT_EQ(stored, cloud.points) << "scan " << sequence;
  }

  static constexpr std::uint64_t kSeed = 8;
  TempDir directory_;
};

TEST_F(ExactlyOnceTest, AScanArrivesOverAWayThatBreaksInEveryChunk) {
  const auto process = Start();
  const auto direct = ConnectTo(process->Address());
  STRATA_ASSERT_OK(direct->maps().Create({}, kMap, {}));
  constexpr std::size_t kPoints = 10 * kChunk;
  std::mt19937_64 random(kSeed);
  // Somewhere in the second chunk of each connection.
  CuttingProxy proxy(process->Address(),
                     [&] { return kChunkBytes + kChunkBytes / 4 + random() % (kChunkBytes / 2); });
  const PointCloud cloud = NumberedCloud(1, kPoints);
  const auto db = ConnectTo(proxy.address());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto upload,
                              db->scans().Upload({}, kMap, NumberedHeader(1, cloud)));
  STRATA_ASSERT_OK(WriteUpTo(*upload, cloud, kPoints));
  STRATA_ASSERT_OK(upload->Finish());
  std::cout << proxy.cuts() << " cuts, " << proxy.bytes() << " bytes for " << kPoints * 12 << "\n";
  EXPECT_GE(proxy.cuts(), 5);
  ExpectStored(*direct, 1, kPoints);
}

TEST_F(ExactlyOnceTest, AScanGoesOnAfterItsServerWasKilled) {
  auto process = Start();
  const std::string address = process->Address();
  const auto db = ConnectTo(address);
  STRATA_ASSERT_OK(db->maps().Create({}, kMap, {}));
  constexpr std::size_t kPoints = 600'000;
  const PointCloud cloud = NumberedCloud(1, kPoints);
  const ScanHeader header = NumberedHeader(1, cloud);
  STRATA_ASSERT_OK_AND_ASSIGN(auto upload, db->scans().Upload({}, kMap, header));
  STRATA_ASSERT_OK(WriteUpTo(*upload, cloud, 500'000));
  absl::SleepFor(absl::Milliseconds(300));  // until most of it has arrived
  process->Signal(SIGKILL);
  process->Wait();
  process = Start(address);
  ASSERT_EQ(process->Address(), address);
  {
    STRATA_ASSERT_OK_AND_ASSIGN(const auto other, db->scans().Upload({}, kMap, header));
    std::cout << other->points_held() << " points held after the restart\n";
    EXPECT_GE(other->points_held(), 200'000U);
  }
  upload = nullptr;
  STRATA_ASSERT_OK_AND_ASSIGN(upload, db->scans().Upload({}, kMap, header));
  STRATA_ASSERT_OK(WriteUpTo(*upload, cloud, kPoints));
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, upload->Finish());
  EXPECT_FALSE(ack.already_present);
  ExpectStored(*db, 1, kPoints);
}

TEST_F(ExactlyOnceTest, TheUploadItselfOutlivesItsServer) {
  auto process = Start();
  const std::string address = process->Address();
  const auto db = ConnectTo(address);
  STRATA_ASSERT_OK(db->maps().Create({}, kMap, {}));
  constexpr std::size_t kPoints = 400'000;
  const PointCloud cloud = NumberedCloud(1, kPoints);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto upload,
                              db->scans().Upload({}, kMap, NumberedHeader(1, cloud)));
  for (std::size_t begin = 0; begin < kPoints; begin += kChunk) {
    if (begin % 100'000 == 50'000) {
      process->Signal(SIGKILL);
      process->Wait();
      process = Start(address);
      ASSERT_EQ(process->Address(), address);
    }
    STRATA_ASSERT_OK(upload->Write(SliceOf(cloud, begin, begin + kChunk)));
  }
  STRATA_ASSERT_OK(upload->Finish());
  ExpectStored(*db, 1, kPoints);
}

TEST_F(ExactlyOnceTest, ARobotThatIsKilledLosesNoScanOfItsSpool) {
  const auto process = Start();
  const auto db = ConnectTo(process->Address());
  STRATA_ASSERT_OK(db->maps().Create({}, kMap, {}));
  constexpr std::uint64_t kScans = 30;
  constexpr std::size_t kPoints = 50'000;
  std::mt19937_64 random(kSeed);
  std::uint64_t added = 0;
  int kills = 0;
  while (true) {
    ChildProcess robot(STRATA_SPOOL_ROBOT,
                       {(directory_.path() / "spool").string(),
                        process->Address(),
                        absl::StrCat(added + 1),
                        absl::StrCat(kScans),
                        absl::StrCat(kPoints)});
    // Long enough to get somewhere, too short to get through.
    const auto life = absl::Milliseconds(60 + static_cast<int>(random() % 200));
    std::atomic<bool> ended = false;
    std::thread killer([&] {
      const absl::Time until = absl::Now() + life;
      while (!ended && absl::Now() < until) absl::SleepFor(absl::Milliseconds(1));
      if (!ended) robot.Signal(SIGKILL);
    });
    for (std::string line = robot.ReadLine(); !line.empty(); line = robot.ReadLine()) {
      ASSERT_TRUE(absl::SimpleAtoi(line, &added));
    }
    ended = true;  // its stdout has: it has ended, but its number is still its own
    killer.join();
    if (robot.Wait() == 0) break;
    ASSERT_LT(++kills, 1000);
  }
  std::cout << kills << " kills\n";
  EXPECT_GE(kills, 3);
  std::uint64_t stored = 0;
  STRATA_ASSERT_OK(db->scans().List({}, kMap, {}, [&](const ScanInfo& info) {
    const std::uint64_t sequence = info.header.id.sequence;
    EXPECT_EQ(info.content_hash,
              NumberedHeader(sequence, NumberedCloud(sequence, kPoints)).content_hash);
    ++stored;
    return absl::OkStatus();
  }));
  EXPECT_EQ(stored, kScans);
  STRATA_ASSERT_OK_AND_ASSIGN(const SpoolStatus left, Spool::Look(directory_.path() / "spool"));
  EXPECT_EQ(left.waiting + left.refused + left.damaged, 0U);
}

}  // namespace
}  // namespace strata::testing
