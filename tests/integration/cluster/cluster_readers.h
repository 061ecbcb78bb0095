// Clients that read one map from several servers, and hold what they are told against each other.
#ifndef STRATA_TESTS_INTEGRATION_CLUSTER_READERS_H_
#define STRATA_TESTS_INTEGRATION_CLUSTER_READERS_H_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"

#include "core/api/database.h"
#include "core/mls/tile_key.h"
#include "tests/integration/campaigns/campaign_world.h"
#include "tests/integration/clients.h"

namespace strata::testing {

// What anybody was told by any server: a version of a tile has one content, a scan one pose in an
// epoch, and an answer is no older than what somebody had been told before it was asked for.
// Thread-safe.
class ServedLedger {
 public:
  explicit ServedLedger(Violations& violations) : violations_(violations) {}

  struct Newest {
    std::map<TileKey, std::uint64_t> tiles;  // versions
    std::uint64_t epoch = 0;
    std::uint64_t integrated = 0;  // scans, where none are deleted
    std::set<std::size_t> places;  // with surfaces, where none are deleted and none move
  };
  // To be asked before a call, and given with its answer.
  Newest newest() const;

  void SawVersion(absl::string_view who,
                  const Newest& before,
                  const TileKey& key,
                  std::uint64_t version);
  void SawTile(absl::string_view who, const Newest& before, const api::EncodedTile& tile);
  void SawEpoch(absl::string_view who, const Newest& before, std::uint64_t epoch);
  void SawIntegrated(absl::string_view who, const Newest& before, std::uint64_t scans);
  // `places`: numbers of those that have surfaces.
  void SawSurfaces(absl::string_view who,
                   const Newest& before,
                   const std::set<std::size_t>& places);
  void SawPoses(absl::string_view who, const Newest& before, const api::PoseGraphState& graph);
  std::size_t versions() const;

 private:
  using Version = std::pair<TileKey, std::uint64_t>;

  Violations& violations_;
  mutable absl::Mutex mutex_;
  Newest newest_ ABSL_GUARDED_BY(mutex_);
  std::map<Version, std::string> contents_ ABSL_GUARDED_BY(mutex_);
  std::map<std::pair<std::uint64_t, ScanId>, Pose> poses_ ABSL_GUARDED_BY(mutex_);  // by epoch
};

// One call for all that happens; Thread-safe but for Follow().
class ClusterWatcher {
 public:
  // `once`: nothing changes a scan once it is integrated, so that is told once.
  ClusterWatcher(std::string who, bool once, Violations& violations)
      : who_(std::move(who)), once_(once), violations_(violations) {}
  // Until the call is stopped.
  void Follow(api::Database& db, const api::Call& call);
  // After that: what is new, at once; then all it was told is what the map holds.
  void CheckKnowsAll(api::Database& db);
  int updates() const { return updates_; }
  int wholes() const { return wholes_; }

 private:
  absl::Status Take(const api::MapUpdate& update);

  void TakeIntegrated(const ScanId& id);

  const std::string who_;
  const bool once_;
  Violations& violations_;
  api::WatchOptions resume_;
  std::map<ScanId, ScanState> scans_;
  std::map<TileKey, std::uint64_t> tiles_;  // versions
  std::set<ScanId> integrated_;             // since it was told everything
  std::atomic<int> updates_ = 0;
  std::atomic<int> wholes_ = 0;
};

// A reader a server and one of all, and as many watchers.
class ClusterReaders {
 public:
  // Begins; the world must outlive it. `deletions`: scans and tiles may go.
  ClusterReaders(CampaignWorld& world, bool deletions, std::uint64_t seed);
  void Stop() { clients_.Stop(); }
  // After Stop(), and once nothing is written any more.
  void Check();
  std::map<std::string, double> Numbers() const;

 private:
  void AddReader(const std::string& who, const std::string& address, std::uint64_t seed);
  void Read(api::Database& db, const std::string& who, std::uint64_t draw);
  absl::Status ReadTiles(api::Database& db, const std::string& who, std::uint64_t draw);
  absl::Status FetchTiles(api::Database& db, const std::string& who);
  absl::Status ReadStats(api::Database& db, const std::string& who);
  absl::Status ReadScan(api::Database& db, const std::string& who, std::uint64_t draw);
  absl::Status ReadPoses(api::Database& db, const std::string& who);
  absl::Status ReadSurfaces(api::Database& db, const std::string& who);
  absl::Status ReadPlan(api::Database& db, const std::string& who, std::uint64_t draw);

  CampaignWorld& world_;
  const bool deletions_;
  ServedLedger ledger_;
  std::vector<std::unique_ptr<ClusterWatcher>> watchers_;  // the last: of all servers
  std::atomic<int> answers_ = 0;
  std::atomic<int> refusals_ = 0;
  std::atomic<int> paths_ = 0;
  Clients clients_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_CLUSTER_READERS_H_
