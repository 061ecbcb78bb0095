#include "core/engine/scans/scan_share.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>

#include <gtest/gtest.h>

#include "core/common/cache_budget.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

constexpr std::size_t kBudget = std::size_t{160} << 20;
constexpr std::uint64_t kLarge = 4'000'000;

ScanRecord ScanOf(std::uint64_t points) {
  ScanRecord scan;
  scan.header.point_count = points;
  return scan;
}

// Whether so much is left of the half that may be reserved.
bool HasRoom(CacheBudget& budget, std::size_t bytes) {
  if (!budget.Reserve(bytes)) return false;
  budget.Release(bytes);
  return true;
}

TEST(ScanShareTest, OneLargeScanLeavesRoomForSearchesAndForNoOtherScan) {
  const auto budget = std::make_shared<CacheBudget>(kBudget);
  std::optional<ScanShare> share;
  share.emplace(budget, ScanOf(kLarge));
  EXPECT_TRUE(HasRoom(*budget, kBudget / 10));
  EXPECT_FALSE(HasRoom(*budget, kBudget / 8 * 3));
  std::atomic<bool> taken = false;
  std::thread other([&] {
    const ScanShare second(budget, ScanOf(kLarge));
    taken = true;
  });
  EXPECT_FALSE(taken);
  share.reset();
  other.join();
  EXPECT_TRUE(taken);
  EXPECT_TRUE(HasRoom(*budget, kBudget / 2));
}

TEST(ScanShareTest, SmallScansTakeNothing) {
  const auto budget = std::make_shared<CacheBudget>(kBudget);
  const ScanShare share(budget, ScanOf(120'000));
  EXPECT_TRUE(HasRoom(*budget, kBudget / 2));
}

TEST(ScanShareTest, WithinOneAnotherNobodyWaits) {
  const auto budget = std::make_shared<CacheBudget>(kBudget);
  const ScanShare outer(budget, ScanOf(kLarge));
  { const ScanShare inner(budget, ScanOf(kLarge)); }
  EXPECT_FALSE(HasRoom(*budget, kBudget / 8 * 3));  // the outer one's still
}

TEST(ScanShareTest, OfABudgetOfNothingScansAreWorkedOnToo) {
  const auto budget = std::make_shared<CacheBudget>(0);
  const ScanShare share(budget, ScanOf(kLarge));
}

}  // namespace
}  // namespace strata
