// Uploads whose way breaks, whose server dies or whose sender dies arrive once and whole.
#include <algorithm>
#include <csignal>
#include <cstdint>
#include <iostream>
#include <memory>
#include <random>
#include <string>

#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "core/cloud/cloud_slice.h"
#include "core/common/status.h"
#include "tests/integration/campaigns/campaign_scans.h"
#include "tests/integration/campaigns/campaign_world.h"
#include "tests/integration/clients.h"
#include "tests/integration/lost_answers/cutting_proxy.h"
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
  const auto direct = ConnectPatiently(process->Address());
  STRATA_ASSERT_OK(direct->maps().Create({}, kMap, {}));
  constexpr std::size_t kPoints = 10 * kChunk;
  std::mt19937_64 random(kSeed);
  // Somewhere in the second chunk of each connection.
  CuttingProxy proxy(process->Address(), [&]() -> CuttingProxy::Allowance {
    return {.bytes = kChunkBytes + kChunkBytes / 4 + random() % (kChunkBytes / 2)};
  });
  const PointCloud cloud = NumberedCloud(1, kPoints);
  const auto db = ConnectPatiently(proxy.address());
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
  const auto db = ConnectPatiently(address);
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
  const auto db = ConnectPatiently(address);
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
  CampaignOptions options;
  options.folder = directory_.path();
  options.robots = 1;
  options.period_ms = 0;
  CampaignWorld world(options);
  world.StartRobots();
  std::mt19937_64 random(kSeed);
  for (int kill = 0; kill < 15 || world.Acknowledged().size() < 5; ++kill) {
    ASSERT_LT(kill, 1000);
    absl::SleepFor(absl::Milliseconds(60 + static_cast<int>(random() % 300)));
    world.robot(0).Kill();
  }
  world.RetireRobotsAndCheck();
  EXPECT_THAT(world.violations().All(), ::testing::IsEmpty());
  const auto stored = world.StoredHashes();
  for (const auto& [id, hash] : stored) {
    const PointCloud cloud = CampaignCloud(id, options.columns);
    EXPECT_EQ(hash, CampaignHeader(id, cloud, Alignment::kOff).content_hash) << id.ToString();
  }
}

}  // namespace
}  // namespace strata::testing
