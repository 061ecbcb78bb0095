#include "tests/integration/campaigns/campaign_world.h"

#include <csignal>
#include <iostream>
#include <optional>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "client/sdk/client.h"
#include "client/sdk/spool.h"
#include "core/common/status.h"
#include "tests/integration/campaigns/campaign_scans.h"
#include "tests/support/patience.h"

namespace strata::testing {
namespace {

constexpr int kReplayThreads = 2;
constexpr int kMostLists = 20;

absl::Status UploadAgain(api::Database& db, const ScanHeader& header, const PointCloud& cloud) {
  STRATA_ASSIGN_OR_RETURN(const auto upload, db.scans().Upload({}, kCampaignMap, header));
  STRATA_RETURN_IF_ERROR(upload->Write(cloud));
  return upload->Finish().status();
}

}  // namespace

void Violations::Add(absl::string_view what) {
  std::cerr << "VIOLATION " << what << std::endl;
  absl::MutexLock lock(&mutex_);
  all_.emplace_back(what);
}

void Violations::Check(absl::string_view what, const absl::Status& status) {
  if (!status.ok()) Add(absl::StrCat(what, ": ", status.ToString()));
}

std::vector<std::string> Violations::All() const {
  absl::MutexLock lock(&mutex_);
  return all_;
}

std::unique_ptr<api::Database> ConnectTo(const std::string& target) {
  ClientOptions options;
  options.target = target;
  auto client = Connect(options);
  return client.ok() ? *std::move(client) : nullptr;
}

CampaignWorld::CampaignWorld(const CampaignOptions& options)
    : options_(options), addresses_(options.servers, "127.0.0.1:0"), servers_(options.servers) {
  for (std::size_t i = 0; i < servers(); ++i) LaunchServer(i);  // all at once
  for (std::size_t i = 0; i < servers(); ++i) AwaitServing(i);
  if (servers() > 1) db_ = ConnectTo(address());
  if (db_ != nullptr) {
    violations_.Check("create", db_->maps().Create({}, kCampaignMap, {}).status());
  }
}

CampaignWorld::~CampaignWorld() {
  for (const auto& robot : robots_) robot->Kill();
}

void CampaignWorld::StartRobots() {
  for (int number = 1; number <= options_.robots; ++number) {
    RobotOptions robot;
    robot.spool = options_.folder / absl::StrCat("spool", number);
    robot.server = address();
    robot.number = number;
    robot.period_ms = options_.period_ms;
    robot.columns = options_.columns;
    robot.align = options_.align;
    robots_.push_back(std::make_unique<RobotKeeper>(robot));
  }
}

std::string CampaignWorld::address() const { return absl::StrJoin(addresses_, ","); }

std::vector<std::string> CampaignWorld::ServerArguments(const std::string& maps,
                                                        const std::string& listen) const {
  return {"--data", (options_.folder / maps).string(), "--listen", listen, "--optimize-every", "0"};
}

void CampaignWorld::LaunchServer(std::size_t i) {
  const std::string maps = i == 0 ? "maps" : absl::StrCat("maps", i);
  std::vector<std::string> arguments = ServerArguments(maps, addresses_[i]);
  const auto add = [&arguments](const char* option, const std::string& value) {
    arguments.insert(arguments.end(), {option, value});
  };
  if (!options_.store.empty()) {
    add("--store", options_.store);
    add("--server-name", NameOf(i));
  }
  if (!options_.roles.empty()) add("--role", options_.roles[i % options_.roles.size()]);
  if (options_.lease > absl::ZeroDuration()) {
    add("--map-lease", absl::StrCat(absl::ToDoubleSeconds(options_.lease)));
  }
  servers_[i] = options_.server_program.empty()
                    ? std::make_unique<StratadProcess>(arguments)
                    : std::make_unique<StratadProcess>(options_.server_program, arguments);
}

void CampaignWorld::AwaitServing(std::size_t i) {
  addresses_[i] = servers_[i]->Address();
  std::unique_ptr<api::Database> answers = ConnectTo(addresses_[i]);
  if (answers == nullptr) violations_.Add(absl::StrCat(NameOf(i), " does not answer"));
  // Clients of several find one that comes back by themselves.
  if (servers() == 1) db_ = std::move(answers);
}

void CampaignWorld::StartServer(std::size_t i) {
  LaunchServer(i);
  AwaitServing(i);
}

void CampaignWorld::KillServer(std::size_t i) {
  server(i).Signal(SIGKILL);
  if (const int end = AwaitServerEnd(i); end != -SIGKILL) {
    violations_.Add(absl::StrCat("the server ended with ", end, " before it was killed"));
  }
}

int CampaignWorld::AwaitServerEnd(std::size_t i) { return server(i).Wait(); }

void CampaignWorld::MayBeGone(const ScanId& id) {
  absl::MutexLock lock(&mutex_);
  may_be_gone_.insert(id);
}

std::set<ScanId> CampaignWorld::Acknowledged() const {
  std::set<ScanId> all;
  for (const auto& robot : robots_) all.merge(robot->Acknowledged());
  absl::MutexLock lock(&mutex_);
  for (const ScanId& id : may_be_gone_) all.erase(id);
  return all;
}

bool CampaignWorld::AwaitAcknowledged(std::size_t more, absl::Duration longest) const {
  const auto count = [this] {
    std::size_t all = 0;
    for (const auto& robot : robots_) all += robot->Acknowledged().size();
    return all;
  };
  const std::size_t enough = count() + more;
  for (absl::Duration slept; slept < longest; slept += absl::Milliseconds(5)) {
    if (count() >= enough) return true;
    absl::SleepFor(absl::Milliseconds(5));
  }
  return false;
}

std::map<ScanId, std::string> CampaignWorld::StoredHashes(api::Database& db) {
  std::map<ScanId, std::string> stored;
  absl::Status listed;
  for (int attempt = 0; attempt < kMostLists; ++attempt) {
    stored.clear();
    listed = db.scans().List({}, kCampaignMap, {}, [&](const ScanInfo& info) {
      const bool fresh = stored.emplace(info.header.id, info.content_hash).second;
      if (!fresh) violations_.Add(absl::StrCat(info.header.id.ToString(), " is there twice"));
      return absl::OkStatus();
    });
    if (!absl::IsUnavailable(listed)) break;  // what broke off is not asked again by the client
    absl::SleepFor(absl::Milliseconds(200));
  }
  violations_.Check("list of scans", listed);
  return stored;
}

void CampaignWorld::CheckAcknowledged(api::Database& db) {
  const std::set<ScanId> acknowledged = Acknowledged();
  std::map<ScanId, std::string> added;
  for (const auto& robot : robots_) added.merge(robot->Added());
  const std::map<ScanId, std::string> stored = StoredHashes(db);
  for (const ScanId& id : acknowledged) {
    const auto found = stored.find(id);
    if (found == stored.end()) {
      absl::MutexLock lock(&mutex_);
      if (may_be_gone_.contains(id)) continue;
      violations_.Add(absl::StrCat(id.ToString(), " was acknowledged and is lost"));
    } else if (const auto hash = added.find(id);
               hash != added.end() && hash->second != found->second) {
      violations_.Add(absl::StrCat(id.ToString(), " has another content"));
    }
  }
}

void CampaignWorld::RetireRobotsAndCheck() {
  for (const auto& robot : robots_) robot->Retire();
  for (const auto& robot : robots_) {
    if (robot->failures() > 0) violations_.Add("a robot ended by itself");
  }
  for (int number = 1; number <= options_.robots; ++number) {
    const auto left = Spool::Look(options_.folder / absl::StrCat("spool", number));
    violations_.Check("spool", left.status());
    if (left.ok() && left->waiting + left->refused + left->damaged > 0) {
      violations_.Add(absl::StrCat("spool", number, " is not empty"));
    }
  }
  CheckAcknowledged();
  std::map<ScanId, std::string> stored = StoredHashes();
  absl::MutexLock lock(&mutex_);
  for (const auto& robot : robots_) {
    for (const auto& [id, hash] : robot->Added()) {
      if (stored.contains(id) || may_be_gone_.contains(id)) continue;
      violations_.Add(absl::StrCat(id.ToString(), " was in a spool that is empty, and is lost"));
    }
  }
}

JobInfo CampaignWorld::RunJob(const std::string& kind) {
  JobInfo last;
  const absl::Time end = absl::Now() + kPatience;
  auto job = db().jobs().Start({}, kCampaignMap, kind, {});
  // A server may not know yet that its database is back; started twice it does no harm.
  while (absl::IsUnavailable(job.status()) && absl::Now() < end) {
    absl::SleepFor(absl::Milliseconds(200));
    job = db().jobs().Start({}, kCampaignMap, kind, {});
  }
  violations_.Check(kind, job.status());
  if (!job.ok()) return last;
  const auto follow = [&last](const JobInfo& now) {
    last = now;
    return absl::OkStatus();
  };
  violations_.Check(kind, db().jobs().Watch({}, kCampaignMap, job->id, follow));
  if (last.state != JobState::kSucceeded) {
    violations_.Add(absl::StrCat("job ", kind, " did not succeed: ", last.message));
  }
  return last;
}

MapStats CampaignWorld::AwaitIntegrated(api::Database& db) {
  while (true) {
    const auto stats = db.maps().Stats({}, kCampaignMap);
    violations_.Check("stats", stats.status());
    if (!stats.ok() || stats->scans_pending == 0) return stats.value_or(MapStats());
    absl::SleepFor(absl::Milliseconds(50));
  }
}

std::string CampaignWorld::CheckDerived() {
  AwaitIntegrated(db());
  RunJob("verify");
  const MapStats before = AwaitIntegrated(db());
  if (before.scans_failed > 0) violations_.Add(absl::StrCat(before.scans_failed, " scans failed"));
  RunJob("rebuild");
  const MapStats after = AwaitIntegrated(db());
  if (after.content_digest != before.content_digest) {
    violations_.Add(absl::StrCat(
        "content_digest is ", before.content_digest, ", of a rebuild ", after.content_digest));
  }
  return after.content_digest;
}

std::string CampaignWorld::UndisturbedDigest(const std::map<ScanId, std::string>& hashes) {
  StratadProcess server(ServerArguments("undisturbed", "127.0.0.1:0"));
  const auto db = ConnectTo(server.Address());
  if (db == nullptr) return "";
  violations_.Check("create", db->maps().Create({}, kCampaignMap, {}).status());
  const std::vector<std::pair<ScanId, std::string>> scans(hashes.begin(), hashes.end());
  const auto send = [&](std::size_t first) {
    for (std::size_t i = first; i < scans.size(); i += kReplayThreads) {
      const auto& [id, hash] = scans[i];
      const PointCloud cloud = CampaignCloud(id, options_.columns);
      const ScanHeader header = CampaignHeader(id, cloud, Alignment::kOff);
      if (header.content_hash != hash) {
        violations_.Add(absl::StrCat(id.ToString(), " is not what the robot saw"));
      }
      violations_.Check("undisturbed upload", UploadAgain(*db, header, cloud));
    }
  };
  std::vector<std::thread> senders;
  for (int i = 0; i < kReplayThreads; ++i) senders.emplace_back(send, i);
  for (std::thread& sender : senders) sender.join();
  return AwaitIntegrated(*db).content_digest;
}

std::size_t CampaignWorld::CheckContent(bool compare) {
  for (std::size_t i = 0; i < servers(); ++i) server(i).Signal(SIGTERM);
  for (std::size_t i = 0; i < servers(); ++i) {
    if (const int end = AwaitServerEnd(i); servers() > 1 && end != 0) {
      violations_.Add(absl::StrCat(NameOf(i), " ended with ", end, " after SIGTERM"));
    }
  }
  for (std::size_t i = 0; i < servers(); ++i) StartServer(i);
  const std::map<ScanId, std::string> stored = StoredHashes();
  std::cerr << stored.size() << " scans; verify, rebuild" << std::endl;
  const std::string digest = CheckDerived();
  if (!compare || options_.align) return stored.size();
  std::cerr << "the same scans to an undisturbed server" << std::endl;
  const std::string undisturbed = UndisturbedDigest(stored);
  if (digest != undisturbed) {
    violations_.Add(absl::StrCat("content_digest is ", digest, ", undisturbed ", undisturbed));
  }
  return stored.size();
}

}  // namespace strata::testing
