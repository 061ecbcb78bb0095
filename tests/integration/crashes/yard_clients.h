// Robots that upload what they see of the marked yard, and readers that check what they are told.
#ifndef STRATA_TESTS_INTEGRATION_YARD_CLIENTS_H_
#define STRATA_TESTS_INTEGRATION_YARD_CLIENTS_H_

#include <atomic>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

#include "core/api/database.h"
#include "tests/integration/crashes/epoch_ledger.h"

namespace strata::testing {

inline constexpr char kYardMap[] = "yard";

// UNAVAILABLE and the end of the test are no faults of an answer.
bool Answered(const absl::Status& status);

// One robot's way: scans are sent in order, each from where the map says the one before was.
class YardRobot {
 public:
  explicit YardRobot(int robot) : robot_(robot) {}
  // Uploads the next scan if it may, and goes on only once it is acknowledged.
  void Step(api::Database& db, const api::Call& call);
  // It may send this many.
  void Allow(std::uint64_t scans) { allowed_ = scans; }
  std::uint64_t acknowledged() const { return acknowledged_; }
  ScanId Id(std::uint64_t sequence) const { return YardScan(robot_, sequence); }

 private:
  absl::Status Upload(api::Database& db, const api::Call& call, const ScanId& id) const;

  const int robot_;
  std::atomic<std::uint64_t> allowed_ = 0;
  std::atomic<std::uint64_t> acknowledged_ = 0;
  Pose correction_ = Pose::Identity();  // of the map to the true yard, where it was last
};

// The newest epoch one client was told of: it never goes back, restart or not.
class LastEpoch {
 public:
  explicit LastEpoch(std::string who) : who_(std::move(who)) {}
  void Saw(std::uint64_t epoch);
  const std::string& who() const { return who_; }

 private:
  const std::string who_;
  std::uint64_t epoch_ = 0;
};

// Fetches all tiles, or what changed against those it holds, and looks at all marks.
class TileReader {
 public:
  TileReader(EpochLedger& ledger, bool holds)
      : ledger_(ledger), holds_(holds), last_(holds ? "holder of tiles" : "reader of tiles") {}
  void Step(api::Database& db, const api::Call& call);

 private:
  using Marks = std::map<ScanId, Mark>;
  struct Held {
    std::uint64_t version = 0;
    Marks marks;
  };

  EpochLedger& ledger_;
  const bool holds_;
  LastEpoch last_;
  std::map<TileKey, Held> tiles_;
  std::set<ScanId> seen_;  // marks that were there before
};

// Asks for the whole pose graph and for single poses.
class PoseReader {
 public:
  explicit PoseReader(EpochLedger& ledger) : ledger_(ledger), last_("reader of poses") {}
  void Step(api::Database& db, const api::Call& call);

 private:
  EpochLedger& ledger_;
  LastEpoch last_;
};

// Plans a path through the yard.
class PlanReader {
 public:
  explicit PlanReader(EpochLedger& ledger) : ledger_(ledger), last_("planner") {}
  void Step(api::Database& db, const api::Call& call);

 private:
  EpochLedger& ledger_;
  LastEpoch last_;
};

// Is told what changes.
class Watcher {
 public:
  explicit Watcher(EpochLedger& ledger) : ledger_(ledger), last_("watcher") {}
  void Step(api::Database& db, const api::Call& call);
  // After Step has ended for good: what is new, at once; then all it was told is what the map
  // holds.
  void ExpectKnowsAll(api::Database& db);

 private:
  absl::Status Take(const api::MapUpdate& update);

  EpochLedger& ledger_;
  LastEpoch last_;
  api::WatchOptions resume_;
  std::map<ScanId, api::ScanChange> scans_;
  std::map<TileKey, std::uint64_t> tiles_;  // versions
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_YARD_CLIENTS_H_
