#include "tests/integration/crashes/killed_server.h"

#include <csignal>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {

void KilledServer::Kill() {
  process_->Signal(SIGKILL);
  EXPECT_EQ(process_->Wait(), -SIGKILL);
  Start();
}

JobInfo KilledServer::Follow(std::uint64_t job) {
  JobInfo last;
  STRATA_EXPECT_OK(db().jobs().Watch({}, map_, job, [&last](const JobInfo& now) {
    last = now;
    return absl::OkStatus();
  }));
  EXPECT_EQ(last.state, JobState::kSucceeded) << last.kind << ": " << last.message;
  return last;
}

JobInfo KilledServer::Run(const std::string& kind, const JobParameters& parameters) {
  const auto job = db().jobs().Start({}, map_, kind, parameters);
  STRATA_EXPECT_OK(job);
  return job.ok() ? Follow(job->id) : JobInfo();
}

void KilledServer::AwaitIntegrated() {
  while (true) {
    const auto stats = db().maps().Stats({}, map_);
    STRATA_EXPECT_OK(stats);
    if (!stats.ok() || stats->scans_pending == 0) return;
    absl::SleepFor(absl::Milliseconds(5));
  }
}

void KilledServer::Start() {
  process_ = std::make_unique<StratadProcess>(std::vector<std::string>{
      "--data", (directory_.path() / "maps").string(), "--listen", "127.0.0.1:0"});
  ClientOptions options;
  options.target = process_->Address();
  auto client = Connect(options);
  STRATA_EXPECT_OK(client);
  if (client.ok()) client_ = *std::move(client);
}

}  // namespace strata::testing
