#include "core/engine/models/square_points.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/cache_budget.h"
#include "core/common/stop.h"
#include "core/engine/map/map_core.h"
#include "tests/core/engine/engine_fixture.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

class SquarePointsTest : public EngineTest {
 protected:
  void SetUp() override {
    Reopen();
    MakeMap();
    UploadRooms(6);
    WaitIntegrated(db());
    Close();
  }
  // The map behind the engine's back, with so much for its caches.
  void OpenCore(std::size_t cache_bytes) {
    STRATA_ASSERT_OK_AND_ASSIGN(
        core_,
        MapCore::Open(kMapName, MapFile(), Options(), std::make_shared<CacheBudget>(cache_bytes)));
  }
  void TearDown() override {
    if (core_ != nullptr) core_->Close();
    core_.reset();
  }

  // Of all squares, twice in a row.
  std::vector<PosedPoints> LoadAll(SquarePoints& squares) {
    std::vector<PosedPoints> all;
    STRATA_EXPECT_OK(squares.ListScans(core_->snapshots().current().epoch, Stop()));
    for (int round = 0; round < 2; ++round) {
      for (std::size_t i = 0; i < squares.squares().size(); ++i) {
        auto points = squares.Load(i, Stop());
        STRATA_EXPECT_OK(points);
        if (points.ok()) all.push_back(*std::move(points));
      }
    }
    return all;
  }

  std::unique_ptr<MapCore> core_;
};

bool AreSame(const PosedPoints& a, const PosedPoints& b) {
  const auto same_view = [](const PosedPoints::View& u, const PosedPoints::View& v) {
    return u.sensor == v.sensor && u.end == v.end;
  };
  return a.origin == b.origin && a.points == b.points &&
         std::equal(a.views.begin(), a.views.end(), b.views.begin(), b.views.end(), same_view);
}

TEST_F(SquarePointsTest, SaysTheSameWithAndWithoutRoomToHoldScans) {
  std::vector<std::vector<PosedPoints>> loaded;
  for (const std::size_t cache_bytes :
       {std::size_t{64} << 20, std::size_t{120} << 10, std::size_t{0}}) {
    OpenCore(cache_bytes);
    {
      SquarePoints squares(*core_, {});
      loaded.push_back(LoadAll(squares));
      EXPECT_EQ(core_->caches()->cached_bytes() > 0, cache_bytes > 0);
      EXPECT_LE(core_->caches()->cached_bytes(), cache_bytes);
    }
    EXPECT_EQ(core_->caches()->cached_bytes(), 0U);
    core_->Close();
    core_.reset();
  }
  const std::size_t count = loaded[0].size();
  ASSERT_GT(count, 0U);
  std::size_t points = 0;
  for (std::size_t i = 0; i < count; ++i) {
    points += loaded[0][i].points.size();
    EXPECT_TRUE(AreSame(loaded[0][i], loaded[0][(i + count / 2) % count]));
    EXPECT_TRUE(AreSame(loaded[0][i], loaded[1].at(i)));
    EXPECT_TRUE(AreSame(loaded[0][i], loaded[2].at(i)));
  }
  EXPECT_GT(points, 10'000U);
}

TEST_F(SquarePointsTest, ThinsFullSquaresAndSaysSo) {
  OpenCore(std::size_t{1} << 20);
  SquarePoints all(*core_, {});
  const std::vector<PosedPoints> whole = LoadAll(all);
  EXPECT_EQ(all.thinned_squares(), 0U);
  EXPECT_EQ(all.most_thinned(), 1U);
  constexpr std::size_t kMost = 1500;
  SquarePoints few(*core_, {}, kMost);
  const std::vector<PosedPoints> thinned = LoadAll(few);
  EXPECT_GT(few.thinned_squares(), 0U);
  EXPECT_GE(few.most_thinned(), 2U);
  ASSERT_EQ(whole.size(), thinned.size());
  for (std::size_t i = 0; i < whole.size(); ++i) {
    EXPECT_LE(thinned[i].points.size(), kMost);
    EXPECT_EQ(thinned[i].views.back().end, thinned[i].points.size());
    if (whole[i].points.size() > kMost) {
      EXPECT_GT(thinned[i].points.size(), kMost / 3);
    }
  }
}

}  // namespace
}  // namespace strata::testing
