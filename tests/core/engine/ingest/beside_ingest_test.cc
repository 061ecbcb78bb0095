// What ingest does beside the scan it places: the next scan made ready, the last tiles written. The
// map is that of one thread.
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/surface_tile_codec.h"
#include "core/engine/ingest/scans_ahead.h"
#include "core/engine/map/map_core.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

constexpr std::uint64_t kScans = 16;
// This one's points are out of the sensor's range.
constexpr std::uint64_t kFaulty = 9;

Pose WayOf(std::uint64_t k) {
  const auto n = static_cast<double>(k);
  return PoseAt(0.7 * n - 8.0, 0.1 * n, 0.02 * n);
}

// What a map says, but for the numbers of its commits.
struct MapContent {
  std::string digest;
  std::vector<PoseNode> nodes;
  std::vector<Constraint> constraints;
  std::map<TileKey, std::vector<Surface>> surfaces;
};

class BesideIngestTest : public EngineTest {
 protected:
  EngineOptions With(int threads) const {
    EngineOptions options = Options();
    options.worker_threads = threads;
    options.max_batch_scans = 3;
    return options;
  }
  // The first scan takes so long that the others wait behind it.
  void UploadDrive() {
    const PointCloud large = SeeWorld(WayOf(0), 1, 400'000);
    STRATA_ASSERT_OK(Upload(db(), HeaderOf({"run", 0}, large, WayOf(0)), large, 40'000));
    for (std::uint64_t k = 1; k <= kScans; ++k) {
      PointCloud cloud = SeeWorld(WayOf(k), k);
      if (k == kFaulty) {
        for (Eigen::Vector3f& p : cloud.points) p.x() += 5'000.0F;
      }
      const Pose said = WayOf(k) * PoseAt(0.03 * static_cast<double>(k % 3), 0.02);
      STRATA_ASSERT_OK(
          Upload(db(), HeaderOf({"run", k}, cloud, said, Alignment::kOn), cloud, 6'000));
    }
  }
  MapContent Content() {
    MapContent content;
    const MapStats stats = WaitIntegrated(db());
    EXPECT_EQ(stats.scans_failed, 1U);
    content.digest = stats.content_digest;
    const auto graph = db().posegraph().Get({}, kMapName);
    EXPECT_THAT(graph, IsOk());
    content.nodes = graph->nodes;
    content.constraints = graph->constraints;
    for (const auto& [key, bytes] : AllTiles(db())) {
      const auto tile = DecodeSurfaceTile(bytes);
      EXPECT_THAT(tile, IsOk());
      content.surfaces[key] = tile->surfaces;
    }
    return content;
  }
  static void ExpectSame(const MapContent& a, const MapContent& b) {
    EXPECT_EQ(a.digest, b.digest);
    ASSERT_EQ(a.nodes.size(), b.nodes.size());
    for (std::size_t i = 0; i < a.nodes.size(); ++i) {
      EXPECT_EQ(a.nodes[i].id, b.nodes[i].id);
      EXPECT_TRUE(a.nodes[i].T_map_scan.matrix() == b.nodes[i].T_map_scan.matrix())
          << a.nodes[i].id.ToString();
    }
    ASSERT_EQ(a.constraints.size(), b.constraints.size());
    for (std::size_t i = 0; i < a.constraints.size(); ++i) {
      EXPECT_TRUE(a.constraints[i].T_i_j.matrix() == b.constraints[i].T_i_j.matrix());
      EXPECT_TRUE(a.constraints[i].information == b.constraints[i].information);
    }
    EXPECT_EQ(a.surfaces, b.surfaces);
  }
  MapContent Drive(int threads) {
    Reopen(With(threads));
    MakeMap();
    UploadDrive();
    MapContent content = Content();
    ExpectSound();
    STRATA_EXPECT_OK(db().maps().Delete({}, kMapName));
    return content;
  }
};

TEST_F(BesideIngestTest, TheMapIsThatOfOneThread) {
  const MapContent one = Drive(1);
  EXPECT_EQ(one.nodes.size(), kScans + 1);  // with the faulty one
  EXPECT_GT(one.constraints.size(), kScans);
  for (const int threads : {2, 3}) {
    SCOPED_TRACE(threads);
    ExpectSame(Drive(threads), one);
  }
}

TEST_F(BesideIngestTest, WhatIsLeftAtTheEndIsIntegratedByTheNextStart) {
  const MapContent whole = Drive(1);
  Reopen(With(2));
  MakeMap();
  UploadDrive();
  Reopen(With(2));
  ExpectSame(Content(), whole);
  ExpectSound();
}

TEST_F(BesideIngestTest, ScansLeaveWhileOthersWait) {
  Reopen(With(2));
  MakeMap();
  UploadDrive();
  for (std::uint64_t k = 2; k <= kScans; k += 5) {
    STRATA_EXPECT_OK(db().scans().Delete({}, kMapName, {"run", k}));
  }
  EXPECT_EQ(WaitIntegrated(db()).scans_pending, 0U);
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseGraphState graph, db().posegraph().Get({}, kMapName));
  EXPECT_EQ(graph.nodes.size(), kScans + 1 - 3);
  ExpectSound();
}

// The map's file in this test's hands; the engine is closed.
class ScansAheadTest : public EngineTest {
 protected:
  static constexpr std::uint64_t kRooms = 6;

  std::unique_ptr<MapCore> OpenCore(int threads) const {
    EngineOptions options = Options();
    options.worker_threads = threads;
    auto core = MapCore::Open(
        kMapName, MapFile(), options, std::make_shared<CacheBudget>(options.cache_bytes));
    EXPECT_THAT(core, IsOk());
    return *std::move(core);
  }
  static std::vector<PosedScan> ScansOf(MapCore& core) {
    const auto reader = core.Reader();
    EXPECT_THAT(reader, IsOk());
    return (*reader)->ListScans({}, core.snapshots().current().epoch).value();
  }
  void SetUp() override {
    MakeMap();
    UploadRooms(kRooms);
    WaitIntegrated(db());
    Close();
  }
  // By scan; nullptr where there is an error.
  std::vector<std::shared_ptr<const ScanFeatures>> Take(int threads) const {
    const auto core = OpenCore(threads);
    const std::vector<PosedScan> scans = ScansOf(*core);
    ScansAhead ahead(*core, scans);
    std::vector<std::shared_ptr<const ScanFeatures>> features;
    for (std::size_t i = 0; i < scans.size(); ++i) {
      const auto ready = ahead.Take(i);
      EXPECT_TRUE(ready.ok() || absl::IsDataLoss(ready.status())) << ready.status();
      features.push_back(ready.ok() ? ready->features : nullptr);
    }
    return features;
  }
  static void ExpectSame(const ScanFeatures& a, const ScanFeatures& b) {
    for (int c = 0; c < kFeatureClasses; ++c) {
      EXPECT_EQ(a.points(static_cast<FeatureClass>(c)), b.points(static_cast<FeatureClass>(c)));
    }
    ASSERT_EQ(a.sample().size(), b.sample().size());
    for (std::size_t i = 0; i < a.sample().size(); ++i) {
      EXPECT_EQ(a.sample()[i].element.point, b.sample()[i].element.point);
      EXPECT_EQ(a.sample()[i].element.normal, b.sample()[i].element.normal);
    }
  }
};

TEST_F(ScansAheadTest, EachIsThatOfItsScan) {
  const auto one = Take(1);
  const auto two = Take(2);
  ASSERT_EQ(one.size(), kRooms);
  ASSERT_EQ(two.size(), kRooms);
  for (std::size_t i = 0; i < kRooms; ++i) ExpectSame(*one[i], *two[i]);
}

TEST_F(ScansAheadTest, AFaultIsThatOfItsScan) {
  const auto whole = Take(1);
  Sql("UPDATE truth_chunk SET bytes = x'00' WHERE upload = "
      "(SELECT upload FROM truth_scan ORDER BY number LIMIT 1 OFFSET 2)");
  const auto two = Take(2);
  ASSERT_EQ(two.size(), kRooms);
  for (std::size_t i = 0; i < kRooms; ++i) {
    if (i == 2) {
      EXPECT_EQ(two[i], nullptr);
    } else {
      ExpectSame(*two[i], *whole[i]);
    }
  }
}

TEST_F(ScansAheadTest, OneThatNobodyTakesIsLetGo) {
  const auto core = OpenCore(2);
  const std::vector<PosedScan> scans = ScansOf(*core);
  {
    ScansAhead ahead(*core, scans);
    STRATA_EXPECT_OK(ahead.Take(0).status());
  }
  core->Close();  // waits for readers on loan
}

}  // namespace
}  // namespace strata::testing
