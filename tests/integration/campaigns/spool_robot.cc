// A robot that can be killed: adds its scans to its spool, sends them meanwhile, and says on stdout
//   added N HASH
//   acked N
// Ends with 0 once all is sent; after SIGTERM it takes no further scan.
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <iostream>
#include <set>
#include <string>

#include "absl/time/clock.h"
#include <CLI/CLI.hpp>

#include "client/sdk/client.h"
#include "client/sdk/spool.h"
#include "core/common/status.h"
#include "tests/integration/campaigns/campaign_scans.h"
#include "tests/integration/marked_yard.h"

namespace strata::testing {
namespace {

constexpr std::size_t kMostWaiting = 4;

std::atomic<bool> returning = false;

struct Robot {
  std::string spool;
  std::string server;
  int number = 1;
  std::uint64_t first = 1;
  std::uint64_t last = 1'000'000;
  int period_ms = 0;
  int columns = 640;
  bool align = false;
};

// Its spool is what outlives it; a server that is away is nothing to die of.
absl::StatusOr<std::unique_ptr<api::Database>> ConnectAtLast(const std::string& server) {
  ClientOptions options;
  options.target = server;
  options.connect_timeout = absl::Seconds(1);
  while (true) {
    auto client = Connect(options);
    if (!absl::IsUnavailable(client.status())) return client;
  }
}

absl::Status AddScan(Spool& spool, const Robot& robot, std::uint64_t sequence) {
  const ScanId id = YardScan(robot.number, sequence);
  const PointCloud cloud = CampaignCloud(id, robot.columns);
  const ScanHeader header =
      CampaignHeader(id, cloud, robot.align ? Alignment::kOn : Alignment::kOff);
  STRATA_RETURN_IF_ERROR(spool.Add(kCampaignMap, header, cloud));
  std::cout << "added " << sequence << " " << header.content_hash << std::endl;
  return absl::OkStatus();
}

// Tells of those that wait no longer.
void SayAcknowledged(const Spool& spool, std::set<std::uint64_t>& waiting) {
  std::set<std::uint64_t> now;
  for (const ScanId& id : spool.Waiting(kCampaignMap)) now.insert(id.sequence);
  for (const std::uint64_t sequence : waiting) {
    if (!now.contains(sequence)) std::cout << "acked " << sequence << std::endl;
  }
  waiting = std::move(now);
}

absl::Status Run(const Robot& robot) {
  STRATA_ASSIGN_OR_RETURN(const auto spool, Spool::Open(robot.spool));
  STRATA_ASSIGN_OR_RETURN(const auto database, ConnectAtLast(robot.server));
  std::set<std::uint64_t> waiting;
  SayAcknowledged(*spool, waiting);
  const SpoolSender sender(*spool, *database);
  std::uint64_t next = robot.first;
  auto due = std::chrono::steady_clock::now();
  while (true) {
    const bool more = next <= robot.last && !returning;
    if (more && waiting.size() < kMostWaiting && std::chrono::steady_clock::now() >= due) {
      STRATA_RETURN_IF_ERROR(AddScan(*spool, robot, next));
      waiting.insert(next++);
      due = std::chrono::steady_clock::now() + std::chrono::milliseconds(robot.period_ms);
    }
    SayAcknowledged(*spool, waiting);
    if (!more && waiting.empty()) break;
    absl::SleepFor(absl::Milliseconds(5));
  }
  const SpoolStatus left = spool->status();
  if (left.refused + left.damaged == 0) return absl::OkStatus();
  return absl::InternalError("scans were refused or damaged");
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) {
  using strata::testing::Robot;
  Robot robot;
  CLI::App app("A robot that can be killed");
  app.add_option("--spool", robot.spool, "Directory")->required();
  app.add_option("--server", robot.server, "HOST:PORT")->required();
  app.add_option("--robot", robot.number, "1 to 8");
  app.add_option("--first", robot.first, "Its next scan");
  app.add_option("--last", robot.last, "Its last scan");
  app.add_option("--period-ms", robot.period_ms, "Time between scans");
  app.add_option("--columns", robot.columns, "Of its sensor, with 32 rings");
  app.add_flag("--align", robot.align, "Let the server align what it sends");
  CLI11_PARSE(app, argc, argv);
  std::signal(SIGTERM, [](int) { strata::testing::returning = true; });
  const absl::Status done = strata::testing::Run(robot);
  if (!done.ok()) std::cerr << "robot" << robot.number << ": " << done << std::endl;
  return done.ok() ? 0 : 1;
}
