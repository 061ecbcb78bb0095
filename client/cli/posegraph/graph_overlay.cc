#include "client/cli/posegraph/graph_overlay.h"

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

#include "client/cli/posegraph/constraint_residual.h"

namespace strata::cli {
namespace {

using picture::Stroke;

constexpr std::array<Colour, 5> kTrajectoryColours = {
    {{120, 72, 0}, {0, 96, 140}, {90, 0, 110}, {70, 90, 0}, {150, 40, 70}}};
constexpr std::size_t kMostNames = 8;

constexpr Colour kIngestColour = {0, 128, 150};
constexpr Colour kClosureColour = {0, 150, 70};
constexpr Colour kPriorColour = {130, 60, 200};
constexpr Colour kStressedColour = {245, 140, 0};
constexpr Colour kViolatedColour = {210, 0, 150};
constexpr Colour kDisabledColour = {150, 150, 150};
constexpr Colour kResidualColour = {0, 0, 0};
// Bounds of the normalised residual.
constexpr double kStressed = 1.0;
constexpr double kViolated = 9.0;

Stroke StrokeOf(const ConstraintResidual& residual) {
  const Constraint& constraint = *residual.constraint;
  Stroke stroke;
  stroke.points = {residual.T_map_i.translation(), residual.T_map_j.translation()};
  stroke.width_pixels = constraint.origin == ConstraintOrigin::kIngest ? 1.5 : 4.0;
  stroke.dashed = !constraint.enabled;
  if (!constraint.enabled) {
    stroke.colour = kDisabledColour;
  } else if (residual.normalised_chi2 > kViolated) {
    stroke.colour = kViolatedColour;
  } else if (residual.normalised_chi2 > kStressed) {
    stroke.colour = kStressedColour;
  } else if (constraint.is_prior()) {
    stroke.colour = kPriorColour;
  } else {
    stroke.colour = constraint.origin == ConstraintOrigin::kIngest ? kIngestColour : kClosureColour;
  }
  return stroke;
}

// From where the constraint says that j is to where it is.
Stroke ResidualStroke(const ConstraintResidual& residual) {
  const Pose said = residual.constraint->is_prior() ? residual.T_map_i
                                                    : residual.T_map_i * residual.constraint->T_i_j;
  return {{said.translation(), residual.T_map_j.translation()}, kResidualColour, 2.0, false};
}

}  // namespace

void AddTrajectories(const api::PoseGraphState& state, picture::Overlay& overlay) {
  std::map<ScanId, Eigen::Vector3d> places;
  for (const PoseNode& node : state.nodes) places.emplace(node.id, node.T_map_scan.translation());
  std::map<std::string, picture::Path> ways;
  for (const auto& [id, place] : places) ways[id.trajectory].push_back(place);
  std::size_t count = 0;
  for (auto& [name, way] : ways) {
    const Colour colour = kTrajectoryColours[count % kTrajectoryColours.size()];
    overlay.strokes.push_back({std::move(way), colour, 3.0, false});
    if (count < kMostNames) overlay.legend.emplace_back(colour, absl::AsciiStrToLower(name));
    ++count;
  }
  if (count > kMostNames) {
    overlay.legend.emplace_back(kDisabledColour, absl::StrCat("and ", count - kMostNames, " more"));
  }
}

void AddConstraints(const api::PoseGraphState& state, picture::Overlay& overlay) {
  const std::vector<ConstraintResidual> residuals = ResidualsOf(state);
  // Closures, of which there are few, above the many others.
  for (const bool ingest : {true, false}) {
    for (const ConstraintResidual& residual : residuals) {
      if ((residual.constraint->origin == ConstraintOrigin::kIngest) != ingest) continue;
      overlay.strokes.push_back(StrokeOf(residual));
      if (residual.constraint->enabled) overlay.strokes.push_back(ResidualStroke(residual));
    }
  }
  overlay.legend.insert(overlay.legend.end(),
                        {{kIngestColour, "matched at ingest"},
                         {kClosureColour, "closure"},
                         {kPriorColour, "prior"},
                         {kStressedColour, "chi2 1 to 9"},
                         {kViolatedColour, "chi2 above 9"},
                         {kDisabledColour, "disabled"},
                         {kResidualColour, "residual"}});
}

}  // namespace strata::cli
