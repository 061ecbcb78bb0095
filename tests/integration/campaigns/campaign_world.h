// A stratad, or several of one database, with robots that upload to one map, to be disturbed, and
// what must hold all the same.
#ifndef STRATA_TESTS_INTEGRATION_CAMPAIGN_WORLD_H_
#define STRATA_TESTS_INTEGRATION_CAMPAIGN_WORLD_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/api/database.h"
#include "tests/integration/campaigns/robot_keeper.h"
#include "tests/integration/stratad_process.h"

namespace strata::testing {

struct CampaignOptions {
  std::uint64_t seed = 1;
  std::filesystem::path folder;  // empty; maps and spools lie there
  int robots = 8;                // at most kYardRobots
  int period_ms = 500;           // of a robot, between scans
  int columns = 640;             // of CampaignCloud
  bool align = false;
  std::string store;               // the address of a database; empty: maps are files
  int servers = 1;                 // more than one: of `store`
  std::vector<std::string> roles;  // --role of the servers, by turns; empty: as the program has it
  absl::Duration lease = {};       // of a map; zero: as the program has it
  std::string server_program;      // another one than stratad
};

struct CampaignReport {
  std::map<std::string, double> numbers;
  std::vector<std::string> violations;
};

// What did not hold. Thread-safe.
class Violations {
 public:
  void Add(absl::string_view what);
  // Adds it unless the status is OK.
  void Check(absl::string_view what, const absl::Status& status);
  std::vector<std::string> All() const;

 private:
  mutable absl::Mutex mutex_;
  std::vector<std::string> all_ ABSL_GUARDED_BY(mutex_);
};

class CampaignWorld {
 public:
  // Starts the servers and makes the map.
  explicit CampaignWorld(const CampaignOptions& options);
  ~CampaignWorld();

  void StartRobots();
  // Starts a server and waits until it serves, at the address of its first start.
  void StartServer(std::size_t i = 0);
  // Starts it and does not wait.
  void LaunchServer(std::size_t i = 0);
  // Kills the server.
  void KillServer(std::size_t i = 0);
  // Waits for the server's end after a signal to it: its exit code, or minus the signal.
  int AwaitServerEnd(std::size_t i = 0);
  StratadProcess& server(std::size_t i = 0) { return *servers_[i]; }
  std::size_t servers() const { return servers_.size(); }
  // --server-name of a server.
  static std::string NameOf(std::size_t i) { return "server" + std::to_string(i); }

  // By all servers.
  api::Database& db() { return *db_; }
  // Of all servers.
  std::string address() const;
  const std::string& address_of(std::size_t i) const { return addresses_[i]; }
  const std::filesystem::path& folder() const { return options_.folder; }
  Violations& violations() { return violations_; }
  RobotKeeper& robot(std::size_t i) { return *robots_[i]; }
  std::size_t robots() const { return robots_.size(); }

  // Those that a client takes out of the map: from now on they may be missing.
  void MayBeGone(const ScanId& id);
  // Scans that robots saw acknowledged, but for those.
  std::set<ScanId> Acknowledged() const;
  // Waits until robots have seen so many more of them. False if that takes longer.
  bool AwaitAcknowledged(std::size_t more, absl::Duration longest) const;

  // By the list of a server, or of any of them, which must have each scan once.
  std::map<ScanId, std::string> StoredHashes() { return StoredHashes(db()); }
  std::map<ScanId, std::string> StoredHashes(api::Database& db);
  // All that is acknowledged is there, with its content.
  void CheckAcknowledged() { CheckAcknowledged(db()); }
  void CheckAcknowledged(api::Database& db);
  // Robots go home; then every scan that any of them added is there and integrated.
  void RetireRobotsAndCheck();
  // Runs a job to its end; what it ends with must be success.
  JobInfo RunJob(const std::string& kind);
  // After another start, which takes back scans that two kills met: the map verifies and is what a
  // rebuild makes of its scans; and, if `compare`, what a server of its own makes of them that gets
  // the same scans and is left in peace. Returns how many there are.
  std::size_t CheckContent(bool compare);

 private:
  std::vector<std::string> ServerArguments(const std::string& maps,
                                           const std::string& listen) const;
  void AwaitServing(std::size_t i);
  MapStats AwaitIntegrated(api::Database& db);
  // Returns the digest.
  std::string CheckDerived();
  std::string UndisturbedDigest(const std::map<ScanId, std::string>& hashes);

  const CampaignOptions options_;
  Violations violations_;
  std::vector<std::string> addresses_;
  std::vector<std::unique_ptr<StratadProcess>> servers_;
  std::unique_ptr<api::Database> db_;
  std::vector<std::unique_ptr<RobotKeeper>> robots_;
  mutable absl::Mutex mutex_;
  std::set<ScanId> may_be_gone_ ABSL_GUARDED_BY(mutex_);
};

// A client of the server at `target`; nothing if none answers in time.
std::unique_ptr<api::Database> ConnectTo(const std::string& target);

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_CAMPAIGN_WORLD_H_
