// Tiles prepared for several searches at once.
#include "core/planning/tile_cache.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gtest/gtest.h>

#include "core/common/cache_budget.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground/profile_checks.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::DrawnMap;
using ::strata::testing::MemoryTiles;

// Far from each other, so that a preparation loads no tile but its own.
TileKey FarTile(int i) { return {0, 3 * i, 0}; }

std::vector<SurfaceTile> FarTiles(int count) {
  std::vector<SurfaceTile> tiles;
  for (int i = 0; i < count; ++i) {
    DrawnMap map;
    map[{3 * i * kTileCells, 0}] = {{0.0}};
    for (SurfaceTile& tile : map.Tiles()) tiles.push_back(std::move(tile));
  }
  return tiles;
}

// Holds every preparation until `all` searches have asked for their tile, and counts how many are
// being prepared.
class CountingTiles : public MemoryTiles {
 public:
  CountingTiles(std::vector<SurfaceTile> tiles, int all)
      : MemoryTiles(std::move(tiles)), all_(all) {}

  void SearchAsks() {
    absl::MutexLock lock(&mutex_);
    ++asking_;
  }
  absl::StatusOr<std::shared_ptr<const SurfaceTile>> Load(const TileKey& key) override {
    {
      absl::MutexLock lock(&mutex_);
      most_ = std::max(most_, ++preparing_);
      mutex_.Await(absl::Condition(this, &CountingTiles::AllAsk));
    }
    absl::SleepFor(absl::Milliseconds(50));  // they reach their turn
    absl::MutexLock lock(&mutex_);
    --preparing_;
    return MemoryTiles::Load(key);
  }
  int most() const {
    absl::MutexLock lock(&mutex_);
    return most_;
  }

 private:
  bool AllAsk() const ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return asking_ == all_; }

  const int all_;
  mutable absl::Mutex mutex_;
  int asking_ ABSL_GUARDED_BY(mutex_) = 0;
  int preparing_ ABSL_GUARDED_BY(mutex_) = 0;
  int most_ ABSL_GUARDED_BY(mutex_) = 0;
};

struct Preparations {
  int most_at_a_time = 0;
  int by_all_threads = 0;  // of those, the ones that were given the loop
};

Preparations PrepareByThreads(int threads, int preparations) {
  CountingTiles tiles(FarTiles(threads), threads);
  absl::Mutex mutex;
  std::vector<std::thread::id> looped;
  const auto loop = [&](std::size_t count, absl::FunctionRef<absl::Status(std::size_t)> body) {
    {
      absl::MutexLock lock(&mutex);
      if (std::ranges::find(looped, std::this_thread::get_id()) == looped.end()) {
        looped.push_back(std::this_thread::get_id());
      }
    }
    absl::Status status;
    for (std::size_t i = 0; i < count; ++i) status.Update(body(i));
    return status;
  };
  TileCache cache(std::make_shared<CacheBudget>(std::size_t{1} << 28), loop, preparations);
  const auto checks = MakeProfileChecks({}, 0.1);
  STRATA_EXPECT_OK(checks);
  {
    std::vector<std::jthread> searches;
    for (int i = 0; i < threads; ++i) {
      searches.emplace_back([&, i] {
        tiles.SearchAsks();
        STRATA_EXPECT_OK(cache.Get(tiles, FarTile(i), *checks));
      });
    }
  }
  EXPECT_EQ(cache.statistics().prepared, static_cast<std::uint64_t>(threads));
  return {tiles.most(), static_cast<int>(looped.size())};
}

TEST(TileCacheTest, FewTilesArePreparedAtATime) {
  EXPECT_EQ(PrepareByThreads(5, 1).most_at_a_time, 1);
  EXPECT_EQ(PrepareByThreads(6, 2).most_at_a_time, 2);
}

TEST(TileCacheTest, APreparationThatOthersWaitForTakesOneThread) {
  EXPECT_EQ(PrepareByThreads(1, 1).by_all_threads, 1);
  const int of_five = PrepareByThreads(5, 1).by_all_threads;
  EXPECT_GE(of_five, 1) << "the last one keeps nobody waiting";
  EXPECT_LT(of_five, 5);
}

}  // namespace
}  // namespace strata
