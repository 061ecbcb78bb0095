#include "tests/integration/cluster/cluster_readers.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <Eigen/Core>

#include "core/common/random.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "tests/integration/campaigns/campaign_scans.h"

namespace strata::testing {
namespace {

constexpr absl::Duration kLongestCall = absl::Seconds(3);  // with a server that is frozen
constexpr absl::Duration kPause = absl::Milliseconds(30);
constexpr absl::Duration kPauseInFetch = absl::Milliseconds(5);
constexpr double kSamePose = 1e-12;

api::Call Patient() {
  api::Call call;
  call.stop = Stop(SteadyNow() + kLongestCall);
  return call;
}

// All over the world that the robots see.
std::vector<Eigen::Vector2d> Places() {
  constexpr int kSide = 5;
  constexpr double kSpacingM = 4.0;
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i < kSide * kSide; ++i) {
    places.emplace_back(kSpacingM * (i % kSide - kSide / 2), kSpacingM * (i / kSide - kSide / 2));
  }
  return places;
}

// What servers that are killed, frozen or without their database may say.
bool IsTrouble(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status) ||
         absl::IsCancelled(status) || absl::IsResourceExhausted(status);
}

}  // namespace

ServedLedger::Newest ServedLedger::newest() const {
  absl::MutexLock lock(&mutex_);
  return newest_;
}

std::size_t ServedLedger::versions() const {
  absl::MutexLock lock(&mutex_);
  return contents_.size();
}

void ServedLedger::SawVersion(absl::string_view who,
                              const Newest& before,
                              const TileKey& key,
                              std::uint64_t version) {
  const auto known = before.tiles.find(key);
  if (known != before.tiles.end() && version < known->second) {
    violations_.Add(absl::StrCat(who,
                                 ": tile ",
                                 key.ToString(),
                                 " went back from version ",
                                 known->second,
                                 " to ",
                                 version));
  }
  absl::MutexLock lock(&mutex_);
  std::uint64_t& newest = newest_.tiles[key];
  newest = std::max(newest, version);
}

void ServedLedger::SawTile(absl::string_view who,
                           const Newest& before,
                           const api::EncodedTile& tile) {
  SawVersion(who, before, tile.key, tile.version);
  SawEpoch(who, before, tile.epoch);
  absl::MutexLock lock(&mutex_);
  const auto [it, fresh] = contents_.emplace(Version(tile.key, tile.version), tile.bytes);
  if (fresh || it->second == tile.bytes) return;
  violations_.Add(absl::StrCat(
      who, ": version ", tile.version, " of tile ", tile.key.ToString(), " has two contents"));
}

void ServedLedger::SawEpoch(absl::string_view who, const Newest& before, std::uint64_t epoch) {
  if (epoch < before.epoch) {
    violations_.Add(absl::StrCat(who, ": epoch went back from ", before.epoch, " to ", epoch));
  }
  absl::MutexLock lock(&mutex_);
  newest_.epoch = std::max(newest_.epoch, epoch);
}

void ServedLedger::SawIntegrated(absl::string_view who, const Newest& before, std::uint64_t scans) {
  if (scans < before.integrated) {
    violations_.Add(absl::StrCat(
        who, ": ", scans, " scans are integrated, somebody saw ", before.integrated, " before"));
  }
  absl::MutexLock lock(&mutex_);
  newest_.integrated = std::max(newest_.integrated, scans);
}

void ServedLedger::SawSurfaces(absl::string_view who,
                               const Newest& before,
                               const std::set<std::size_t>& places) {
  if (!std::includes(places.begin(), places.end(), before.places.begin(), before.places.end())) {
    violations_.Add(absl::StrCat(who,
                                 ": surfaces at ",
                                 places.size(),
                                 " places, not at all of the ",
                                 before.places.size(),
                                 " where there were some"));
  }
  absl::MutexLock lock(&mutex_);
  newest_.places.insert(places.begin(), places.end());
}

void ServedLedger::SawPoses(absl::string_view who,
                            const Newest& before,
                            const api::PoseGraphState& graph) {
  SawEpoch(who, before, graph.epoch);
  absl::MutexLock lock(&mutex_);
  for (const PoseNode& node : graph.nodes) {
    if (node.state != ScanState::kIntegrated) continue;
    const auto [it, fresh] = poses_.emplace(std::pair(graph.epoch, node.id), node.T_map_scan);
    if (fresh || it->second.isApprox(node.T_map_scan, kSamePose)) continue;
    violations_.Add(
        absl::StrCat(who, ": scan ", node.id.ToString(), " has two poses in epoch ", graph.epoch));
  }
}

absl::Status ClusterWatcher::Take(const api::MapUpdate& update) {
  ++updates_;
  if (update.epoch < resume_.epoch || update.commit_sequence < resume_.since) {
    violations_.Add(absl::StrCat(who_,
                                 ": went back from ",
                                 resume_.since,
                                 " of epoch ",
                                 resume_.epoch,
                                 " to ",
                                 update.commit_sequence,
                                 " of epoch ",
                                 update.epoch));
  }
  resume_.since = update.commit_sequence;
  resume_.epoch = update.epoch;
  const std::map<TileKey, std::uint64_t> before = tiles_;
  if (update.whole) {
    ++wholes_;
    scans_.clear();
    tiles_.clear();
    integrated_.clear();
  }
  for (const api::ScanChange& scan : update.scans) {
    scans_[scan.id] = scan.state;
    if (scan.gone) scans_.erase(scan.id);
    if (scan.state == ScanState::kIntegrated && !scan.gone) TakeIntegrated(scan.id);
  }
  for (const api::TileChangeNotice& tile : update.tiles) {
    const auto known = before.find(tile.key);
    if (known != before.end() && tile.version < known->second && !tile.gone) {
      violations_.Add(absl::StrCat(who_, ": tile ", tile.key.ToString(), " went back"));
    }
    tiles_[tile.key] = tile.version;
    if (tile.gone) tiles_.erase(tile.key);
  }
  return absl::OkStatus();
}

void ClusterWatcher::TakeIntegrated(const ScanId& id) {
  if (integrated_.insert(id).second || !once_) return;
  violations_.Add(absl::StrCat(who_, ": told twice that scan ", id.ToString(), " is integrated"));
}

void ClusterWatcher::Follow(api::Database& db, const api::Call& call) {
  const absl::Status ended = db.maps().Watch(
      call, kCampaignMap, resume_, [this](const api::MapUpdate& update) { return Take(update); });
  if (!ended.ok() && !IsTrouble(ended)) violations_.Check(who_, ended);
}

void ClusterWatcher::CheckKnowsAll(api::Database& db) {
  resume_.once = true;
  violations_.Check(who_, db.maps().Watch({}, kCampaignMap, resume_, [this](const auto& update) {
    return Take(update);
  }));
  std::map<ScanId, ScanState> scans;
  violations_.Check(who_, db.scans().List({}, kCampaignMap, {}, [&](const ScanInfo& info) {
    scans[info.header.id] = info.state;
    return absl::OkStatus();
  }));
  if (scans != scans_) {
    violations_.Add(
        absl::StrCat(who_, ": knows ", scans_.size(), " scans, not as the ", scans.size(), " are"));
  }
  const auto listed = db.tiles().List({}, kCampaignMap, {});
  violations_.Check(who_, listed.status());
  if (!listed.ok()) return;
  std::map<TileKey, std::uint64_t> tiles;
  for (const api::TileInfo& tile : *listed) tiles[tile.key] = tile.version;
  if (tiles != tiles_) violations_.Add(absl::StrCat(who_, ": knows other tiles than there are"));
}

ClusterReaders::ClusterReaders(CampaignWorld& world, bool deletions, std::uint64_t seed)
    : world_(world), deletions_(deletions), ledger_(world.violations()) {
  for (std::size_t i = 0; i < world_.servers(); ++i) {
    AddReader(CampaignWorld::NameOf(i), world_.address_of(i), seed + i);
  }
  AddReader("all servers", world_.address(), seed + world_.servers());
}

void ClusterReaders::AddReader(const std::string& who,
                               const std::string& address,
                               std::uint64_t seed) {
  auto random = std::make_shared<SplitMix64>(seed);
  clients_.Add(address, [this, who, random](api::Database& db, const api::Call&) {
    Read(db, absl::StrCat("reader of ", who), random->Next());
    absl::SleepFor(kPause);
  });
  watchers_.push_back(std::make_unique<ClusterWatcher>(
      absl::StrCat("watcher of ", who), !deletions_, world_.violations()));
  ClusterWatcher* const watcher = watchers_.back().get();
  clients_.Add(address,
               [watcher](api::Database& db, const api::Call& call) { watcher->Follow(db, call); });
}

void ClusterReaders::Read(api::Database& db, const std::string& who, std::uint64_t draw) {
  for (const absl::Status& done : {ReadTiles(db, who, draw),
                                   FetchTiles(db, who),
                                   ReadStats(db, who),
                                   ReadScan(db, who, draw),
                                   ReadPoses(db, who),
                                   ReadSurfaces(db, who),
                                   ReadPlan(db, who, draw)}) {
    ++(done.ok() ? answers_ : refusals_);
    if (!IsTrouble(done)) world_.violations().Check(who, done);
  }
}

absl::Status ClusterReaders::ReadTiles(api::Database& db,
                                       const std::string& who,
                                       std::uint64_t draw) {
  ServedLedger::Newest before = ledger_.newest();
  STRATA_ASSIGN_OR_RETURN(const auto listed, db.tiles().List(Patient(), kCampaignMap, {}));
  for (const api::TileInfo& tile : listed) {
    ledger_.SawVersion(who, before, tile.key, tile.version);
  }
  if (listed.empty()) return absl::OkStatus();
  before = ledger_.newest();
  const TileKey key = listed[draw % listed.size()].key;
  const auto tile = db.tiles().Get(Patient(), kCampaignMap, key);
  if (deletions_ && absl::IsNotFound(tile.status())) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(tile.status());
  ledger_.SawTile(who, before, *tile);
  return absl::OkStatus();
}

// All tiles of one state, by a reader who takes his time.
absl::Status ClusterReaders::FetchTiles(api::Database& db, const std::string& who) {
  const ServedLedger::Newest before = ledger_.newest();
  std::set<std::uint64_t> epochs;
  const auto take = [&](const api::TileUpdate& update) -> absl::Status {
    absl::SleepFor(kPauseInFetch);
    epochs.insert(update.tile.epoch);
    if (update.kind == api::TileUpdate::Kind::kDamaged) {
      world_.violations().Add(
          absl::StrCat(who, ": tile ", update.tile.key.ToString(), " is damaged"));
    } else if (update.kind != api::TileUpdate::Kind::kGone) {
      ledger_.SawTile(who, before, update.tile);
    }
    return absl::OkStatus();
  };
  const absl::Status fetched = db.tiles().Fetch(Patient(), kCampaignMap, {}, {}, take);
  if (epochs.size() > 1) world_.violations().Add(absl::StrCat(who, ": a fetch is of two epochs"));
  return fetched;
}

absl::Status ClusterReaders::ReadStats(api::Database& db, const std::string& who) {
  const ServedLedger::Newest before = ledger_.newest();
  STRATA_ASSIGN_OR_RETURN(const MapStats stats, db.maps().Stats(Patient(), kCampaignMap));
  if (!deletions_) ledger_.SawIntegrated(who, before, stats.scans - stats.scans_pending);
  return absl::OkStatus();
}

// What is acknowledged is there for everybody.
absl::Status ClusterReaders::ReadScan(api::Database& db,
                                      const std::string& who,
                                      std::uint64_t draw) {
  const std::set<ScanId> acknowledged = world_.Acknowledged();
  if (acknowledged.empty()) return absl::OkStatus();
  // Rather one of the last.
  const std::size_t back = draw % std::min<std::size_t>(acknowledged.size(), 8);
  const ScanId id = *std::prev(acknowledged.end(), static_cast<std::ptrdiff_t>(back) + 1);
  const absl::Status found = db.scans().Get(Patient(), kCampaignMap, id).status();
  if (!absl::IsNotFound(found)) return found;
  if (deletions_ && !world_.Acknowledged().contains(id)) return absl::OkStatus();
  return Annotate(found, who);
}

absl::Status ClusterReaders::ReadPoses(api::Database& db, const std::string& who) {
  const ServedLedger::Newest before = ledger_.newest();
  STRATA_ASSIGN_OR_RETURN(const auto graph, db.posegraph().Get(Patient(), kCampaignMap));
  ledger_.SawPoses(who, before, graph);
  return absl::OkStatus();
}

absl::Status ClusterReaders::ReadSurfaces(api::Database& db, const std::string& who) {
  const ServedLedger::Newest before = ledger_.newest();
  STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceColumn> columns,
                          db.planning().SampleSurfaces(Patient(), kCampaignMap, Places()));
  std::set<std::size_t> places;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (!columns[i].surfaces.empty()) places.insert(i);
  }
  if (!deletions_) ledger_.SawSurfaces(who, before, places);
  return absl::OkStatus();
}

// What is planned holds, by any server, unless the map has changed meanwhile.
absl::Status ClusterReaders::ReadPlan(api::Database& db,
                                      const std::string& who,
                                      std::uint64_t draw) {
  const ServedLedger::Newest before = ledger_.newest();
  const std::vector<Eigen::Vector2d> places = Places();
  const Eigen::Vector2d& from = places[draw % places.size()];
  const Eigen::Vector2d& to = places[draw / places.size() % places.size()];
  PlanQuery query;
  query.from = {from.x(), from.y()};
  query.to = {to.x(), to.y()};
  STRATA_ASSIGN_OR_RETURN(const PlanResult plan,
                          db.planning().PlanPath(Patient(), kCampaignMap, query));
  ledger_.SawEpoch(who, before, plan.epoch);
  if (!plan.found()) return absl::OkStatus();
  ++paths_;
  const ServedLedger::Newest then = ledger_.newest();
  STRATA_ASSIGN_OR_RETURN(
      const PathCheck check,
      db.planning().CheckPath(Patient(), kCampaignMap, {plan.waypoints, query.profile}));
  ledger_.SawEpoch(who, then, check.epoch);
  return absl::OkStatus();
}

void ClusterReaders::Check() {
  for (const auto& watcher : watchers_) watcher->CheckKnowsAll(world_.db());
}

std::map<std::string, double> ClusterReaders::Numbers() const {
  int updates = 0;
  int wholes = 0;
  for (const auto& watcher : watchers_) {
    updates += watcher->updates();
    wholes += watcher->wholes();
  }
  return {{"reads_answered", answers_},
          {"reads_refused", refusals_},
          {"paths_planned", paths_},
          {"watch_updates", updates},
          {"watch_wholes", wholes},
          {"tile_versions", static_cast<double>(ledger_.versions())}};
}

}  // namespace strata::testing
