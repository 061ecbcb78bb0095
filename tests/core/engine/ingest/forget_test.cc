// What was deleted leaves no trace: the map is that of the remaining scans where they are now.
#include <cstdint>
#include <iterator>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/surface_tile_codec.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

// A scan of the map, as the test knows it.
struct Kept {
  Pose T_map_scan = Pose::Identity();
  std::vector<std::uint16_t> labels;  // that a person gave it; empty: none
};

class EngineForgetTest : public EngineTest {
 protected:
  Pose RandomPose() {
    std::uniform_real_distribution<double> place(-18.0, 18.0);
    std::uniform_real_distribution<double> turn(-3.0, 3.0);
    return PoseAt(place(random_), place(random_), turn(random_));
  }
  void UploadOne() {
    const std::uint64_t sequence = ++last_;
    const Pose T_map_scan = RandomPose();
    UploadRoom(sequence, T_map_scan);
    kept_[sequence].T_map_scan = T_map_scan;
  }
  std::uint64_t Pick() {
    auto it = kept_.begin();
    std::advance(it, random_() % kept_.size());
    return it->first;
  }
  void DeleteOne() {
    const std::uint64_t sequence = Pick();
    STRATA_ASSERT_OK(db().scans().Delete({}, kMapName, {"run", sequence}));
    kept_.erase(sequence);
  }
  void MoveOne() {
    const std::uint64_t sequence = Pick();
    WaitIntegrated(db());
    kept_[sequence].T_map_scan = RandomPose();
    STRATA_ASSERT_OK(
        db().posegraph().SetPose({}, kMapName, {"run", sequence}, kept_[sequence].T_map_scan));
  }
  void LabelOne() {
    const std::uint64_t sequence = Pick();
    std::vector<std::uint16_t> labels(MakeRoom(sequence).size());
    for (std::uint16_t& label : labels) label = static_cast<std::uint16_t>(random_() % 4);
    STRATA_ASSERT_OK(
        db().scans().SetLabels({}, kMapName, {"run", sequence}, labels, api::LabelMode::kReplace));
    kept_[sequence].labels = labels;
  }
  // The kept scans alone, uploaded as they are now, into another map.
  void UploadKept(const std::string& map) {
    MakeMap(SmallMap(), map);
    for (const auto& [sequence, scan] : kept_) {
      PointCloud cloud = MakeRoom(sequence);
      cloud.label = scan.labels;
      const ScanHeader header = HeaderOf({"run", sequence}, cloud, scan.T_map_scan);
      STRATA_ASSERT_OK(Upload(db(), header, cloud, 2000, map));
    }
  }

  std::mt19937_64 random_;
  std::map<std::uint64_t, Kept> kept_;
  std::uint64_t last_ = 0;
};

TEST_F(EngineForgetTest, TilesAreThoseOfTheRemainingScansAtTheirPoses) {
  for (const std::uint64_t seed : {11U, 12U}) {
    SCOPED_TRACE(seed);
    random_.seed(seed);
    kept_.clear();
    MakeMap();
    for (int i = 0; i < 4; ++i) UploadOne();
    for (int step = 0; step < 24; ++step) {
      const std::uint64_t die = random_() % 8;
      if (die < 3 || kept_.size() < 2) {
        UploadOne();
      } else if (die < 6) {
        DeleteOne();
      } else if (die < 7) {
        MoveOne();
      } else {
        LabelOne();
      }
    }
    const std::string digest = Digest();
    const auto tiles = AllTiles(db());
    ExpectSound();
    const std::string fresh = "fresh" + std::to_string(seed);
    UploadKept(fresh);
    EXPECT_EQ(WaitIntegrated(db(), fresh).content_digest, digest);
    const auto expected = AllTiles(db(), fresh);
    EXPECT_EQ(tiles.size(), expected.size());
    for (const auto& [key, bytes] : expected) {
      ASSERT_TRUE(tiles.contains(key)) << key.ToString();
      EXPECT_EQ(DecodeSurfaceTile(tiles.at(key))->surfaces, DecodeSurfaceTile(bytes)->surfaces)
          << key.ToString();
    }
    STRATA_ASSERT_OK(db().maps().Delete({}, kMapName));
  }
}

}  // namespace
}  // namespace strata::testing
