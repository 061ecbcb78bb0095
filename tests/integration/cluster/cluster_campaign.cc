#include "tests/integration/cluster/cluster_campaign.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/storage/postgresql/connection.h"
#include "tests/integration/campaigns/background_work.h"
#include "tests/integration/campaigns/campaign_scans.h"
#include "tests/integration/cluster/cluster_readers.h"
#include "tests/support/paths.h"
#include "tests/support/postgres_cluster.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

using Seconds = std::chrono::duration<double>;

constexpr absl::Duration kLease = absl::Seconds(2);
// Within which somebody takes over and goes on acknowledging.
constexpr absl::Duration kTakeOver = absl::Minutes(3);

// Commits that need not be durable are not, so that a crash of the database loses them.
absl::Status KeepRelaxedCommitsBack(const std::string& database) {
  STRATA_ASSIGN_OR_RETURN(const auto connection, Connection::Open(database));
  STRATA_RETURN_IF_ERROR(connection->Execute("ALTER SYSTEM SET wal_writer_delay = '10s'"));
  return connection->Execute("SELECT pg_reload_conf()");
}

class ClusterCampaign {
 public:
  ClusterCampaign(const ClusterOptions& options, PostgresCluster& database)
      : options_(options),
        database_(database),
        random_(options.world.seed),
        world_(WorldOf(options, database)) {}

  CampaignReport Run();

 private:
  static CampaignOptions WorldOf(const ClusterOptions& options, const PostgresCluster& database);
  void SleepUpTo(double ms) { absl::SleepFor(absl::Milliseconds(random_.Uniform(0.0, ms))); }
  bool Chance(double share) { return random_.Uniform(0.0, 1.0) < share; }
  // By the database: the server that has the map, whether its lease has ended or not.
  std::optional<std::size_t> Owner() const;
  // Rather the one that has the map.
  std::size_t DrawServer();

  // Ends at a moment when scans are on their way.
  void AwaitMoment();
  // Robots go on, and servers know all that was acknowledged.
  void CheckGoesOn();
  void KillRobots();
  void Disturb();
  void Kill(std::size_t server);
  // By SIGTERM.
  void End(std::size_t server);
  // Stops the server for a while, in which other things may happen.
  void Freeze(std::size_t server);
  void CrashDatabase();
  void CheckEnd();

  const ClusterOptions options_;
  PostgresCluster& database_;
  Random random_;
  CampaignWorld world_;
  std::unique_ptr<BackgroundWork> work_;
  std::unique_ptr<ClusterReaders> readers_;
  int faults_ = 0;
  int robot_kills_ = 0;
  std::map<std::string, double> numbers_;
};

CampaignOptions ClusterCampaign::WorldOf(const ClusterOptions& options,
                                         const PostgresCluster& database) {
  CampaignOptions world = options.world;
  world.store = database.Address();
  world.lease = kLease;
  if (!options.fenced) world.server_program = BuiltPath("tests/integration/unfenced_stratad");
  return world;
}

std::optional<std::size_t> ClusterCampaign::Owner() const {
  const auto connection = Connection::Open(database_.Address());
  if (!connection.ok()) return std::nullopt;
  auto row = (*connection)
                 ->Query(
                     "SELECT l.server FROM map_lease AS l JOIN map_place AS p ON p.map = l.map "
                     "WHERE p.name = $1",
                     absl::string_view(kCampaignMap));
  if (!row.ok() || !row->Next()) return std::nullopt;
  for (std::size_t i = 0; i < world_.servers(); ++i) {
    if (row->Text(0) == CampaignWorld::NameOf(i)) return i;
  }
  return std::nullopt;
}

std::size_t ClusterCampaign::DrawServer() {
  const auto any =
      static_cast<std::size_t>(random_.Uniform(0.0, static_cast<double>(world_.servers())));
  return Chance(0.7) ? Owner().value_or(any) : any;
}

void ClusterCampaign::AwaitMoment() {
  if (Chance(0.3)) return SleepUpTo(400.0);
  world_.AwaitAcknowledged(static_cast<std::size_t>(random_.Uniform(1.0, 6.0)), kTakeOver);
  SleepUpTo(60.0);
}

void ClusterCampaign::CheckGoesOn() {
  const auto begin = std::chrono::steady_clock::now();
  if (!world_.AwaitAcknowledged(1, kTakeOver)) world_.violations().Add("nobody takes over");
  const double took = Seconds(std::chrono::steady_clock::now() - begin).count();
  numbers_["longest_without_s"] = std::max(numbers_["longest_without_s"], took);
  world_.CheckAcknowledged();
}

void ClusterCampaign::KillRobots() {
  while (robot_kills_ * options_.faults < faults_ * options_.robot_kills) {
    world_
        .robot(static_cast<std::size_t>(random_.Uniform(0.0, static_cast<double>(world_.robots()))))
        .Kill();
    ++robot_kills_;
  }
}

void ClusterCampaign::Kill(std::size_t server) {
  world_.KillServer(server);
  ++numbers_["kills"];
  if (Chance(0.5)) SleepUpTo(2000.0);  // its lease ends, or it is back before
  world_.StartServer(server);
}

void ClusterCampaign::End(std::size_t server) {
  world_.server(server).Signal(SIGTERM);
  if (const int end = world_.AwaitServerEnd(server); end != 0) {
    world_.violations().Add(
        absl::StrCat(CampaignWorld::NameOf(server), " ended with ", end, " after SIGTERM"));
  }
  ++numbers_["ends"];
  if (Chance(0.5)) SleepUpTo(1000.0);
  world_.StartServer(server);
}

void ClusterCampaign::Freeze(std::size_t server) {
  world_.server(server).Signal(SIGSTOP);
  ++numbers_["freezes"];
  const absl::Time begin = absl::Now();
  const bool beyond = Chance(0.7);
  const double lease_ms = absl::ToDoubleMilliseconds(kLease);
  const auto span = absl::Milliseconds(beyond ? random_.Uniform(1.2 * lease_ms, 3.0 * lease_ms)
                                              : random_.Uniform(0.0, lease_ms));
  if (beyond) ++numbers_["freezes_beyond_lease"];
  const std::size_t other = (server + 1) % world_.servers();
  if (beyond && Chance(0.25)) CrashDatabase();
  if (beyond && Chance(0.25)) Kill(other);
  absl::SleepFor(begin + span - absl::Now());
  world_.server(server).Signal(SIGCONT);
  if (Chance(0.2)) {  // what it finds when it wakes up
    SleepUpTo(10.0);
    world_.server(server).Signal(SIGSTOP);
    SleepUpTo(2.0 * lease_ms);
    world_.server(server).Signal(SIGCONT);
  }
}

void ClusterCampaign::CrashDatabase() {
  database_.Crash();
  ++numbers_["database_crashes"];
  if (Chance(0.7)) SleepUpTo(1500.0);
  world_.violations().Check("database", database_.Restart());
}

void ClusterCampaign::Disturb() {
  const double what = random_.Uniform(0.0, 1.0);
  if (what < 0.3) {
    Kill(DrawServer());
  } else if (what < 0.35) {
    End(DrawServer());
  } else if (what < 0.75) {
    Freeze(DrawServer());
  } else {
    CrashDatabase();
  }
  ++faults_;
}

void ClusterCampaign::CheckEnd() {
  if (work_ != nullptr) {
    work_->StopAndCheck(world_.db());
    for (const auto& [name, number] : work_->Numbers()) numbers_[name] = number;
  }
  world_.RetireRobotsAndCheck();
  readers_->Stop();
  numbers_["scans"] = static_cast<double>(world_.CheckContent(!options_.work));
  readers_->Check();
  for (const auto& [name, number] : readers_->Numbers()) numbers_[name] = number;
}

CampaignReport ClusterCampaign::Run() {
  world_.violations().Check("database", KeepRelaxedCommitsBack(database_.Address()));
  world_.StartRobots();
  if (options_.work) work_ = std::make_unique<BackgroundWork>(world_, options_.world.seed);
  readers_ = std::make_unique<ClusterReaders>(world_, options_.work, options_.world.seed);
  const auto begin = std::chrono::steady_clock::now();
  for (int verified = 0; faults_ < options_.faults;) {
    AwaitMoment();
    KillRobots();
    Disturb();
    CheckGoesOn();
    if (faults_ / options_.verify_every == verified) continue;
    verified = faults_ / options_.verify_every;
    world_.RunJob("verify");
    std::cerr << faults_ << " faults, " << world_.Acknowledged().size() << " scans acknowledged"
              << std::endl;
  }
  numbers_["seconds_of_faults"] = Seconds(std::chrono::steady_clock::now() - begin).count();
  numbers_["faults"] = faults_;
  numbers_["robot_kills"] = robot_kills_;
  CheckEnd();
  return {numbers_, world_.violations().All()};
}

}  // namespace

absl::StatusOr<CampaignReport> RunClusterCampaign(const ClusterOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<PostgresCluster> database,
                          PostgresCluster::Start(PostgresCluster::Disk::kUnsynced));
  return ClusterCampaign(options, *database).Run();
}

}  // namespace strata::testing
