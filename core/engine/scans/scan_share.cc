#include "core/engine/scans/scan_share.h"

#include <algorithm>
#include <cstdint>

#include "core/common/stop.h"

namespace strata {
namespace {

// What a cloud takes while its local map, its planes and its features are made: measured.
constexpr std::uint64_t kBytesAPoint = 90;
constexpr std::uint64_t kSmallBytes = std::uint64_t{16} << 20;

thread_local bool holding = false;

std::uint64_t BytesOf(const ScanRecord& scan) { return scan.header.point_count * kBytesAPoint; }

// Two of them are more than the half of a budget that may be reserved, and one leaves searches
// room.
std::size_t LargestShare(const CacheBudget& budget) { return budget.max_bytes() / 8 * 3; }

}  // namespace

bool ScanShare::IsSmall(const ScanRecord& scan) { return BytesOf(scan) < kSmallBytes; }

ScanShare::ScanShare(const std::shared_ptr<CacheBudget>& budget, const ScanRecord& scan)
    : budget_(budget) {
  const std::uint64_t bytes = BytesOf(scan);
  if (IsSmall(scan) || holding) return;
  const auto share =
      static_cast<std::size_t>(std::min<std::uint64_t>(bytes, LargestShare(*budget)));
  // Without a time limit it ends well for less than half of the budget.
  if (!budget_->AwaitReserve(share, Stop()).ok()) return;
  bytes_ = share;
  holding = true;
}

ScanShare::~ScanShare() {
  if (bytes_ == 0) return;
  budget_->Release(bytes_);
  holding = false;
}

}  // namespace strata
