#include "client/cli/scan/alignment_health.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_format.h"

namespace strata::cli {
namespace {

constexpr std::size_t kFew = 5;
constexpr double kLowOverlap = 0.75;

}  // namespace

void AlignmentHealth::Add(const ScanInfo& scan) {
  if (!(scan.alignment.overlap > 0.0)) return;
  overlaps_.push_back(scan.alignment.overlap);
  aligned_ += scan.alignment.aligned ? 1 : 0;
  at_step_limit_ += absl::StartsWith(scan.alignment.message, "max iterations") ? 1 : 0;
}

double AlignmentHealth::MedianOverlap() const {
  if (overlaps_.empty()) return 0.0;
  std::vector<double> sorted = overlaps_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

std::string AlignmentHealth::Summary() const {
  return absl::StrFormat("median overlap %.2f, %d of %d aligned, %d at the step limit",
                         MedianOverlap(),
                         aligned_,
                         compared(),
                         at_step_limit_);
}

bool AlignmentHealth::Doubtful() const {
  return compared() >= kFew && (MedianOverlap() < kLowOverlap || 2 * aligned_ < compared());
}

void AddHealth(const AlignmentHealth& health, bool for_programs, Json& json) {
  if (health.compared() == 0) return;
  if (!for_programs) {
    json["alignment"] = health.Summary();
    return;
  }
  json["median_overlap"] = health.MedianOverlap();
  json["at_step_limit"] = health.at_step_limit();
  json["poses_doubtful"] = health.Doubtful();
}

}  // namespace strata::cli
