// A real server that dies of its work: it comes back, says of what it died, and goes on without.
#include <algorithm>
#include <csignal>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "core/cloud/cloud_slice.h"
#include "core/common/status.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/paths.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using ::testing::HasSubstr;

constexpr char kMap[] = "world";
constexpr std::size_t kPiece = 40'000;
const ScanId kBig{"big", 1};
const ScanId kSmall{"small", 1};

// A floor with one point a cell, `side` by `side`: large ones take a while to integrate.
PointCloud Floor(int side) {
  PointCloud cloud;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      cloud.points.emplace_back(0.1F * static_cast<float>(x), 0.1F * static_cast<float>(y), 0.0F);
    }
  }
  return cloud;
}

class ServerQuarantineTest : public ::testing::Test {
 protected:
  void Start() {
    server_ = std::make_unique<StratadProcess>(std::vector<std::string>{
        "--data", data_, "--listen", "127.0.0.1:0", "--optimize-every", "0"});
    ClientOptions options;
    options.target = server_->Address();
    STRATA_ASSERT_OK_AND_ASSIGN(db_, Connect(options));
  }
  void End(int signal) {
    server_->Signal(signal);
    EXPECT_EQ(server_->Wait(), -signal);
  }
  // A death of its own, as it takes a SIGSEGV from anywhere.
  void Die() { End(SIGSEGV); }
  absl::Status Put(const ScanId& id, const PointCloud& cloud) {
    ScanHeader header;
    header.id = id;
    header.sensor_origin.z() = 1.0F;
    header.alignment = Alignment::kOff;
    header.point_count = cloud.size();
    STRATA_ASSIGN_OR_RETURN(const auto upload, db_->scans().Upload({}, kMap, header));
    for (std::size_t at = 0; at < cloud.size(); at += kPiece) {
      STRATA_RETURN_IF_ERROR(
          upload->Write(SliceOf(cloud, at, std::min(cloud.size(), at + kPiece))));
    }
    return upload->Finish().status();
  }
  // The server must be down: what `stratad quarantine list` says of `work` behind its name.
  std::string Listed(const std::string& work) {
    ChildProcess list(StratadProgram(), {"quarantine", "list", kMap, "--data", data_});
    std::string found;
    for (std::string line = list.ReadLine(); !line.empty(); line = list.ReadLine()) {
      absl::string_view rest = line;
      if (absl::ConsumePrefix(&rest, work)) found = std::string(rest);
    }
    EXPECT_EQ(list.Wait(), 0);
    return found;
  }
  void Release(const std::vector<std::string>& work) {
    std::vector<std::string> arguments = {"quarantine", "release", kMap, "--data", data_};
    arguments.insert(arguments.end(), work.begin(), work.end());
    EXPECT_EQ(ChildProcess(StratadProgram(), arguments).Wait(), 0);
  }
  ScanInfo AwaitEnd(const ScanId& id) {
    while (true) {
      const auto info = db_->scans().Get({}, kMap, id);
      STRATA_EXPECT_OK(info);
      if (!info.ok() || info->state != ScanState::kPending) return info.value_or(ScanInfo());
      absl::SleepFor(absl::Milliseconds(20));
    }
  }
  JobInfo Run(const std::string& kind) {
    const auto job = db_->jobs().Start({}, kMap, kind, {});
    STRATA_EXPECT_OK(job);
    JobInfo last;
    if (!job.ok()) return last;
    STRATA_EXPECT_OK(db_->jobs().Watch({}, kMap, job->id, [&last](const JobInfo& now) {
      last = now;
      return absl::OkStatus();
    }));
    return last;
  }

  TempDir directory_;
  const std::string data_ = (directory_.path() / "maps").string();
  std::unique_ptr<StratadProcess> server_;
  std::unique_ptr<api::Database> db_;
};

TEST_F(ServerQuarantineTest, AScanAndAJobThatItDiesOfTwice) {
  Start();
  STRATA_ASSERT_OK(db_->maps().Create({}, kMap, {}));
  STRATA_ASSERT_OK(Put(kBig, Floor(1'000)));
  STRATA_ASSERT_OK(Put(kSmall, Floor(50)));
  for (int death = 1; death <= 2; ++death) {
    const std::string says = absl::StrCat("under way    ", death);
    // Dead before the integration began it has not died of it.
    std::string listed;
    for (int wait_ms = 10; !absl::StrContains(listed, says); wait_ms *= 2) {
      ASSERT_LT(wait_ms, 3000) << listed;
      absl::SleepFor(absl::Milliseconds(wait_ms));
      Die();
      listed = Listed("scan big/1");
      if (!absl::StrContains(listed, says)) Start();
    }
    Start();
  }
  const ScanInfo held = AwaitEnd(kBig);
  EXPECT_EQ(held.state, ScanState::kFailed);
  EXPECT_THAT(held.message, HasSubstr("quarantined: the server died 2 times"));
  EXPECT_EQ(AwaitEnd(kSmall).state, ScanState::kIntegrated);
  EXPECT_EQ(Run("verify").state, JobState::kSucceeded);
  Die();
  EXPECT_THAT(Listed("scan big/1"), HasSubstr("quarantined"));
  Release({"scan", "big/1"});
  Start();
  EXPECT_EQ(AwaitEnd(kBig).state, ScanState::kIntegrated);

  const auto job = db_->jobs().Start({}, kMap, "rebuild", {});
  STRATA_ASSERT_OK(job);
  for (int death = 1; death <= 2; ++death) {
    while (db_->jobs().Get({}, kMap, job->id)->state == JobState::kQueued) {
      absl::SleepFor(absl::Milliseconds(1));
    }
    Die();
    EXPECT_THAT(Listed(absl::StrCat("job ", job->id, " (rebuild)")),
                HasSubstr(absl::StrCat("under way    ", death)));
    Start();
  }
  const JobInfo put_aside = *db_->jobs().Get({}, kMap, job->id);
  EXPECT_EQ(put_aside.state, JobState::kFailed);
  EXPECT_THAT(put_aside.message, HasSubstr("quarantined: the server died 2 times while it ran"));
  EXPECT_EQ(Run("verify").state, JobState::kSucceeded);
  STRATA_EXPECT_OK(db_->maps().Delete({}, kMap));
}

// Somebody kills it, again and again, and always while the same scan is under way.
TEST_F(ServerQuarantineTest, AScanThatItIsKilledWithIsInnocent) {
  Start();
  STRATA_ASSERT_OK(db_->maps().Create({}, kMap, {}));
  STRATA_ASSERT_OK(Put(kBig, Floor(1'000)));
  int killed = 0;  // with the scan under way
  for (int wait_ms = 20; wait_ms < 3000 && killed < 3; wait_ms += wait_ms / 4) {
    absl::SleepFor(absl::Milliseconds(wait_ms));
    End(SIGKILL);
    killed += absl::StrContains(Listed("scan big/1"), "under way") ? 1 : 0;
    Start();
  }
  EXPECT_EQ(killed, 3);
  EXPECT_EQ(AwaitEnd(kBig).state, ScanState::kIntegrated);
}

}  // namespace
}  // namespace strata::testing
