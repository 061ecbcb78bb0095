#include "tests/integration/crashes/yard_clients.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/surface_tile_codec.h"
#include "core/common/status.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {

bool Answered(const absl::Status& status) {
  EXPECT_TRUE(status.ok() || absl::IsUnavailable(status) || absl::IsCancelled(status)) << status;
  return status.ok();
}

absl::Status YardRobot::Upload(api::Database& db, const api::Call& call, const ScanId& id) const {
  const PointCloud cloud = SeeYard(id);
  ScanHeader header;
  header.id = id;
  header.T_map_scan = correction_ * YardTruth(id);
  header.point_count = cloud.size();
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::ScanUpload> upload,
                          db.scans().Upload(call, kYardMap, header));
  STRATA_RETURN_IF_ERROR(upload->Write(cloud));
  STRATA_ASSIGN_OR_RETURN(const ScanAck ack, upload->Finish());
  EXPECT_EQ(ack.id, id);
  return absl::OkStatus();
}

void YardRobot::Step(api::Database& db, const api::Call& call) {
  const std::uint64_t next = acknowledged_ + 1;
  if (next > allowed_) return absl::SleepFor(absl::Milliseconds(20));
  if (acknowledged_ > 0) {
    const auto pose = db.posegraph().LookupPose(call, kYardMap, Id(acknowledged_));
    if (Answered(pose.status()) && pose->known) {
      correction_ = pose->T_map_scan * YardTruth(Id(acknowledged_)).inverse();
    }
  }
  // Until the scan is acknowledged: once more with the same bytes.
  while (!Answered(Upload(db, call, Id(next)))) {
    if (call.stop.requested()) return;
  }
  acknowledged_ = next;
}

void LastEpoch::Saw(std::uint64_t epoch) {
  EXPECT_GE(epoch, epoch_) << who_ << ": the epoch went back";
  epoch_ = std::max(epoch_, epoch);
}

void TileReader::Step(api::Database& db, const api::Call& call) {
  if (!holds_) tiles_.clear();
  std::vector<api::HeldTile> held;
  for (const auto& [key, tile] : tiles_) held.push_back({key, tile.version});
  std::map<TileKey, Held> tiles = tiles_;
  std::set<std::uint64_t> epochs;
  const auto take = [&](const api::TileUpdate& update) -> absl::Status {
    epochs.insert(update.tile.epoch);
    const TileKey& key = update.tile.key;
    EXPECT_NE(update.kind, api::TileUpdate::Kind::kDamaged) << key.ToString();
    tiles.erase(key);
    if (update.kind == api::TileUpdate::Kind::kGone) return absl::OkStatus();
    const auto tile = DecodeSurfaceTile(update.tile.bytes);
    EXPECT_THAT(tile, IsOk());
    tiles[key].version = update.tile.version;
    if (tile.ok()) CollectMarks(*tile, tiles[key].marks);
    return absl::OkStatus();
  };
  const bool whole = Answered(db.tiles().Fetch(call, kYardMap, {}, held, take));
  EXPECT_LE(epochs.size(), 1U) << last_.who();
  if (!whole || epochs.empty()) return;
  last_.Saw(*epochs.begin());
  Marks marks;
  for (const auto& [key, tile] : tiles) {
    for (const auto& [id, mark] : tile.marks) marks[id].insert(mark.begin(), mark.end());
  }
  ledger_.SawMarks(last_.who(), *epochs.begin(), marks);
  for (const ScanId& id : seen_) {
    EXPECT_TRUE(marks.contains(id)) << last_.who() << ": " << id.ToString() << " is gone";
  }
  for (const auto& [id, mark] : marks) seen_.insert(id);
  tiles_ = std::move(tiles);
}

void PoseReader::Step(api::Database& db, const api::Call& call) {
  const auto graph = db.posegraph().Get(call, kYardMap);
  if (!Answered(graph.status())) return;
  last_.Saw(graph->epoch);
  for (const PoseNode& node : graph->nodes) {
    if (node.state != ScanState::kIntegrated) continue;
    ledger_.SawPose(last_.who(), graph->epoch, node.id, node.T_map_scan);
  }
  for (const PoseNode& node : graph->nodes) {
    if (node.id.sequence > 2) continue;
    const auto pose = db.posegraph().LookupPose(call, kYardMap, node.id);
    if (!Answered(pose.status())) return;
    last_.Saw(pose->epoch);
    if (pose->known) ledger_.SawPose(last_.who(), pose->epoch, node.id, pose->T_map_scan);
  }
}

void PlanReader::Step(api::Database& db, const api::Call& call) {
  PlanQuery query;
  query.from = {.x_m = -10.0, .y_m = -11.0};
  query.to = {.x_m = -10.0, .y_m = 10.0};
  const auto plan = db.planning().PlanPath(call, kYardMap, query);
  if (!Answered(plan.status())) return;
  last_.Saw(plan->epoch);
  ledger_.SawPlan(*plan);
}

absl::Status Watcher::Take(const api::MapUpdate& update) {
  last_.Saw(update.epoch);
  EXPECT_GE(update.commit_sequence, resume_.since);
  if (update.whole) {
    scans_.clear();
    tiles_.clear();
  }
  resume_.since = update.commit_sequence;
  resume_.epoch = update.epoch;
  for (const api::ScanChange& scan : update.scans) {
    EXPECT_FALSE(scan.gone) << scan.id.ToString();
    scans_[scan.id] = scan;
  }
  for (const api::TileChangeNotice& tile : update.tiles) {
    tiles_[tile.key] = tile.version;
    if (tile.gone) tiles_.erase(tile.key);
  }
  // All it knows is of this epoch now, what it was told earlier too.
  for (const auto& [id, scan] : scans_) {
    if (scan.state != ScanState::kIntegrated) continue;
    ledger_.SawPose(last_.who(), update.epoch, id, scan.T_map_scan);
  }
  return absl::OkStatus();
}

void Watcher::Step(api::Database& db, const api::Call& call) {
  // One call for all restarts.
  EXPECT_THAT(
      db.maps().Watch(
          call, kYardMap, resume_, [this](const api::MapUpdate& update) { return Take(update); }),
      StatusIs(absl::StatusCode::kCancelled, ::testing::_));
}

void Watcher::ExpectKnowsAll(api::Database& db) {
  resume_.once = true;
  STRATA_ASSERT_OK(db.maps().Watch(
      {}, kYardMap, resume_, [this](const api::MapUpdate& update) { return Take(update); }));
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseGraphState graph, db.posegraph().Get({}, kYardMap));
  EXPECT_EQ(scans_.size(), graph.nodes.size());
  for (const PoseNode& node : graph.nodes) {
    EXPECT_EQ(scans_[node.id].state, node.state) << node.id.ToString();
    EXPECT_TRUE(scans_[node.id].T_map_scan.isApprox(node.T_map_scan, 1e-12)) << node.id.ToString();
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto listed, db.tiles().List({}, kYardMap, {}));
  std::map<TileKey, std::uint64_t> versions;
  for (const api::TileInfo& tile : listed) versions[tile.key] = tile.version;
  EXPECT_EQ(tiles_, versions);
}

}  // namespace strata::testing
