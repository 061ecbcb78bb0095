#include "client/formats/bags/transform_tree.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

#include "core/common/status.h"

namespace strata {
namespace {

// Deeper trees are a ring.
constexpr std::size_t kMostFrames = 200;
// More are a file that means harm.
constexpr std::size_t kMostEdges = 10'000;

}  // namespace

absl::Status TransformTree::Add(const RosPose& transform, bool fixed) {
  const std::string& parent = transform.header.frame;
  const std::string& child = transform.child_frame;
  if (parent.empty() || child.empty() || parent == child) {
    return absl::InvalidArgumentError(
        absl::StrCat("a transform from frame '", parent, "' to frame '", child, "'"));
  }
  if (edges_.size() >= kMostEdges && edges_.count(child) == 0) {
    return absl::InvalidArgumentError(absl::StrCat("more than ", kMostEdges, " frames"));
  }
  const auto [edge, is_new] = edges_.try_emplace(child, Edge{.parent = parent, .fixed = fixed});
  if (edge->second.parent != parent) {
    return absl::InvalidArgumentError(
        absl::StrCat("frame ", child, " has two parents, ", edge->second.parent, " and ", parent));
  }
  edge->second.fixed = edge->second.fixed || fixed;
  STRATA_RETURN_IF_ERROR(edge->second.T_parent_child.Add(
      transform.header.stamp_ns, transform.position_m, transform.quaternion));
  ++size_;
  return absl::OkStatus();
}

void TransformTree::DropBefore(std::int64_t stamp_ns) {
  size_ = 0;
  for (auto& [child, edge] : edges_) {
    // Of a fixed one the last that came counts, whatever its stamp.
    edge.T_parent_child.DropBefore(stamp_ns);
    size_ += edge.T_parent_child.size();
  }
}

std::vector<std::string> TransformTree::frames() const {
  std::set<std::string> names;
  for (const auto& [child, edge] : edges_) {
    names.insert(child);
    names.insert(edge.parent);
  }
  return {names.begin(), names.end()};
}

std::vector<std::string> TransformTree::AncestorsOf(const std::string& frame) const {
  std::vector<std::string> frames = {frame};
  while (frames.size() < kMostFrames) {
    const auto edge = edges_.find(frames.back());
    if (edge == edges_.end() || edge->second.T_parent_child.size() == 0) break;
    frames.push_back(edge->second.parent);
  }
  return frames;
}

bool TransformTree::HangsFrom(const std::string& frame, const std::string& above) const {
  const std::vector<std::string> frames = AncestorsOf(frame);
  return std::find(frames.begin() + 1, frames.end(), above) != frames.end();
}

absl::StatusOr<Pose> TransformTree::Along(const std::vector<std::string>& frames,
                                          std::size_t count,
                                          std::int64_t stamp_ns) {
  Pose T = Pose::Identity();
  for (std::size_t i = 0; i < count; ++i) {
    Edge& edge = edges_.at(frames[i]);
    absl::StatusOr<Pose> step = edge.fixed ? absl::StatusOr<Pose>(edge.T_parent_child.Last())
                                           : edge.T_parent_child.At(stamp_ns);
    if (!step.ok()) {
      return Annotate(step.status(), absl::StrCat("from ", edge.parent, " to ", frames[i]));
    }
    T = i == 0 ? *step : *step * T;
  }
  return count > 1 ? Normalized(T) : T;
}

absl::StatusOr<Pose> TransformTree::Lookup(const std::string& a,
                                           const std::string& b,
                                           std::int64_t stamp_ns) {
  const std::vector<std::string> above_a = AncestorsOf(a);
  const std::vector<std::string> above_b = AncestorsOf(b);
  const auto shared =
      std::find_first_of(above_a.begin(), above_a.end(), above_b.begin(), above_b.end());
  if (shared == above_a.end()) {
    return absl::NotFoundError(absl::StrCat("no transforms lead from ",
                                            a,
                                            " to ",
                                            b,
                                            "; there are frames ",
                                            absl::StrJoin(frames(), ", ")));
  }
  const auto up_a = static_cast<std::size_t>(shared - above_a.begin());
  const auto up_b = static_cast<std::size_t>(std::find(above_b.begin(), above_b.end(), *shared) -
                                             above_b.begin());
  STRATA_ASSIGN_OR_RETURN(const Pose T_shared_b, Along(above_b, up_b, stamp_ns));
  if (up_a == 0) return T_shared_b;
  STRATA_ASSIGN_OR_RETURN(const Pose T_shared_a, Along(above_a, up_a, stamp_ns));
  return Normalized(T_shared_a.inverse() * T_shared_b);
}

}  // namespace strata
