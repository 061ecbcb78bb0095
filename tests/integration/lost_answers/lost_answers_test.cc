// Calls whose answer is lost, wherever in it the way breaks: what they ask for happens once.
#include <functional>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "core/common/status.h"
#include "tests/integration/clients.h"
#include "tests/integration/lost_answers/cutting_proxy.h"
#include "tests/integration/numbered_scans.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

constexpr char kMap[] = "world";
constexpr std::size_t kPoints = 3'000;

class LostAnswersTest : public ::testing::Test {
 protected:
  LostAnswersTest()
      : process_({"--data", (directory_.path() / "maps").string(), "--listen", "127.0.0.1:0"}) {}
  void SetUp() override {
    direct_ = ConnectPatiently(process_.Address());
    STRATA_ASSERT_OK(direct_->maps().Create({}, kMap, {}));
  }

  static absl::StatusOr<ScanAck> Put(api::Database& db, std::uint64_t sequence) {
    const PointCloud cloud = NumberedCloud(sequence, kPoints);
    STRATA_ASSIGN_OR_RETURN(const auto upload,
                            db.scans().Upload({}, kMap, NumberedHeader(sequence, cloud)));
    STRATA_RETURN_IF_ERROR(upload->Write(cloud));
    return upload->Finish();
  }

  // Calls `call` with a number of its own and with a client whose way breaks after 0, 1, 2 … frames
  // of the answers to it, once; until there are no more. Returns how often it broke.
  int ForEveryCut(const std::function<void(std::uint64_t, api::Database&)>& call) {
    for (int frames = 0;; ++frames) {
      bool broken = false;
      CuttingProxy proxy(process_.Address(), [&]() -> CuttingProxy::Allowance {
        if (std::exchange(broken, true)) return {};
        return {.answer_frames = frames};
      });
      const auto db = ConnectPatiently(proxy.address());
      SCOPED_TRACE(absl::StrCat("after ", frames, " frames"));
      if (db == nullptr) return frames;
      call(static_cast<std::uint64_t>(frames) + 1, *db);
      if (proxy.cuts() == 0) {
        std::cout << frames << " cuts\n";
        return frames;
      }
    }
  }

  TempDir directory_;
  StratadProcess process_;
  std::unique_ptr<api::Database> direct_;
};

TEST_F(LostAnswersTest, AScanIsStoredOnceAndTheRepeatIsToldSo) {
  // A busy machine may pass the acknowledgement on with the frame before, and none is lost then.
  constexpr int kMaxSweeps = 20;
  int repeats = 0;
  std::uint64_t scans = 0;
  for (int sweep = 0; sweep < kMaxSweeps && repeats == 0; ++sweep) {
    const int cuts = ForEveryCut([&](std::uint64_t, api::Database& db) {
      STRATA_ASSERT_OK_AND_ASSIGN(const ScanAck ack, Put(db, ++scans));
      if (ack.already_present) ++repeats;
    });
    EXPECT_GE(cuts, 3);
  }
  EXPECT_GE(repeats, 1);
  std::set<std::uint64_t> stored;
  STRATA_ASSERT_OK(direct_->scans().List({}, kMap, {}, [&](const ScanInfo& info) {
    EXPECT_TRUE(stored.insert(info.header.id.sequence).second);
    return absl::OkStatus();
  }));
  EXPECT_EQ(stored.size(), scans);
}

TEST_F(LostAnswersTest, AScanIsDeletedWhateverItsClientIsTold) {
  int lost = 0;
  const int cuts = ForEveryCut([&](std::uint64_t number, api::Database& db) {
    STRATA_ASSERT_OK(Put(*direct_, number));
    absl::Status deleted = absl::UnavailableError("not asked yet");
    while (absl::IsUnavailable(deleted)) deleted = db.scans().Delete({}, kMap, {"run", number});
    EXPECT_TRUE(deleted.ok() || absl::IsNotFound(deleted)) << deleted;
    if (absl::IsNotFound(deleted)) ++lost;
    EXPECT_THAT(direct_->scans().Get({}, kMap, {"run", number}),
                StatusIs(absl::StatusCode::kNotFound, ::testing::_));
  });
  EXPECT_GE(cuts, 3);
  EXPECT_GE(lost, 1);
}

TEST_F(LostAnswersTest, APoseIsSetByTheRepeat) {
  STRATA_ASSERT_OK(Put(*direct_, 1));
  while (direct_->maps().Stats({}, kMap)->scans_pending > 0) absl::SleepFor(absl::Milliseconds(5));
  const int cuts = ForEveryCut([&](std::uint64_t number, api::Database& db) {
    Pose pose = Pose::Identity();
    pose.translation().x() = static_cast<double>(number);
    STRATA_EXPECT_OK(db.posegraph().SetPose({}, kMap, {"run", 1}, pose));
    STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo info, direct_->scans().Get({}, kMap, {"run", 1}));
    EXPECT_EQ(info.T_map_scan.translation().x(), pose.translation().x());
  });
  EXPECT_GE(cuts, 3);
}

// It is not repeated by itself, since its effect may have happened.
TEST_F(LostAnswersTest, AJobIsNotStartedTwice) {
  int told = 0;
  const int cuts = ForEveryCut([&](std::uint64_t, api::Database& db) {
    const auto started = db.jobs().Start({}, kMap, "verify", {});
    EXPECT_TRUE(started.ok() || absl::IsUnavailable(started.status())) << started.status();
    if (started.ok()) ++told;
  });
  EXPECT_GE(cuts, 3);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto jobs, direct_->jobs().List({}, kMap));
  EXPECT_GT(jobs.size(), static_cast<std::size_t>(told));
  EXPECT_LE(jobs.size(), static_cast<std::size_t>(cuts) + 1);
}

}  // namespace
}  // namespace strata::testing
