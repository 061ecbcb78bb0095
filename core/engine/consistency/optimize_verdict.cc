#include "core/engine/consistency/optimize_verdict.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace strata {
namespace {

constexpr double kMostLoose = 0.25;
constexpr std::size_t kNamed = 3;

std::string Named(const GraphWorld& world, const OptimizeVerdict& verdict) {
  std::string names;
  for (std::size_t k = 0; k < std::min(kNamed, verdict.loose_steps.size()); ++k) {
    absl::StrAppend(&names, k == 0 ? "" : ", ", world.id(verdict.loose_steps[k].second).ToString());
  }
  if (verdict.loose_steps.size() > kNamed) absl::StrAppend(&names, ", …");
  return names;
}

std::string MessageOf(const GraphWorld& world,
                      const OptimizeVerdict& verdict,
                      AlignmentTermination termination) {
  const bool is_settled = termination == AlignmentTermination::kSettled;
  if (verdict.loose_steps.empty()) {
    return absl::StrFormat("All %d steps from scan to scan are measured. %s",
                           verdict.steps,
                           is_settled ? "Good." : "Usable; run it again for the rest.");
  }
  const std::string held =
      absl::StrFormat("%d of %d steps from scan to scan are the robot's word alone (to %s).",
                      verdict.loose_steps.size(),
                      verdict.steps,
                      Named(world, verdict));
  if (verdict.is_sound) return absl::StrCat(held, " Usable; look at these.");
  return absl::StrCat(
      held,
      " Not applied: too little was measured to move scans by. Scans nearer to each "
      "other, or poses of this recording, would help.");
}

}  // namespace

OptimizeVerdict VerdictOn(const GraphWorld& world, const AlignmentResult& result) {
  OptimizeVerdict verdict;
  if (result.parts.empty()) return verdict;
  for (const std::vector<std::size_t>& trajectory : world.Trajectories()) {
    for (std::size_t k = 1; k < trajectory.size(); ++k) {
      ++verdict.steps;
      if (result.parts[trajectory[k - 1]] == result.parts[trajectory[k]]) continue;
      verdict.loose_steps.push_back({trajectory[k - 1], trajectory[k]});
    }
  }
  verdict.is_sound = static_cast<double>(verdict.loose_steps.size()) <=
                     kMostLoose * static_cast<double>(verdict.steps);
  verdict.message = MessageOf(world, verdict, result.termination);
  return verdict;
}

}  // namespace strata
