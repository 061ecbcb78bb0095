// Kills a process that uploads and looks what is left.
#include <cstdint>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

class CrashTest : public EngineTest {
 protected:
  // Uploads scans `first`, `first` + 1, … and writes each number to `out` once it is acknowledged.
  [[noreturn]] void Uploader(std::uint64_t first, int out) {
    EngineOptions options = Options();
    options.prepare_after = absl::ZeroDuration();  // between the scans
    absl::StatusOr<std::unique_ptr<api::Database>> opened = OpenEngine(options);
    if (!opened.ok()) _exit(1);
    for (std::uint64_t i = first;; ++i) {
      const PointCloud cloud = MakeRoom(i, 400 + i % 7 * 500);
      const ScanHeader header =
          HeaderOf({"run", i}, cloud, PoseAt(static_cast<double>(i % 10), 0.0));
      if (!Upload(**opened, header, cloud).ok()) _exit(2);
      if (write(out, &i, sizeof(i)) != sizeof(i)) _exit(3);
    }
  }

  // Runs an uploader until it has acknowledged `acks` scans, then kills it; returns the last one.
  std::uint64_t RunAndKill(std::uint64_t first, int acks) {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
      close(ends[0]);
      Uploader(first, ends[1]);
    }
    close(ends[1]);
    std::uint64_t last = 0;
    for (int i = 0; i < acks; ++i) {
      if (read(ends[0], &last, sizeof(last)) != sizeof(last)) ADD_FAILURE() << "uploader ended";
    }
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status)) << "uploader exited with " << WEXITSTATUS(status);
    // Acknowledged between our last look and the kill.
    std::uint64_t more = 0;
    while (read(ends[0], &more, sizeof(more)) == sizeof(more)) last = more;
    close(ends[0]);
    return last;
  }
};

TEST_F(CrashTest, EveryAcknowledgedScanIsThereAfterAKill) {
  constexpr std::uint64_t kSeed = 20261121;
  SCOPED_TRACE(kSeed);
  std::mt19937_64 random(kSeed);
  MakeMap();
  Close();  // before the fork: no thread of ours may be alive
  std::uint64_t next = 1;
  for (int round = 0; round < 5; ++round) {
    const std::uint64_t last = RunAndKill(next, 1 + static_cast<int>(random() % 12));
    Reopen();
    STRATA_ASSERT_OK_AND_ASSIGN(const UploadState state,
                                db().scans().GetUploadState({}, kMapName, "run"));
    EXPECT_GE(state.last_sequence, last);
    EXPECT_LE(state.last_sequence, last + 1);  // committed, but killed before it could tell
    EXPECT_EQ(state.scans, state.last_sequence);
    next = state.last_sequence + 1;
    Close();
  }
  Reopen();
  EXPECT_EQ(WaitIntegrated(db()).scans, next - 1);
  const JobInfo verified = RunJob(db(), "verify");
  EXPECT_EQ(verified.state, JobState::kSucceeded) << verified.message;
  EXPECT_EQ(verified.metrics.at("prepared_tiles_damaged"), 0.0);
}

}  // namespace
}  // namespace strata::testing
