#include "core/world/things/kind.h"

#include <cmath>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::size_t kFewestDigits = 4;

absl::Status CheckCount(absl::string_view what,
                        std::size_t count,
                        std::size_t least,
                        std::size_t most) {
  if (count >= least && count <= most) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("kind: ", count, " ", what, ", must be in [", least, ", ", most, "]"));
}

absl::Status CheckPlaces(absl::string_view what, const std::vector<Eigen::Vector3f>& places) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (places[i].cwiseAbs().maxCoeff() <= kMaxKindExtentM && places[i].allFinite()) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "kind: ", what, " ", i, " is not finite or beyond ", kMaxKindExtentM, " m of its origin"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::string_view ToString(KindOrigin origin) {
  switch (origin) {
    case KindOrigin::kFound:
      return "found";
    case KindOrigin::kNamed:
      return "named";
    case KindOrigin::kImported:
      return "imported";
  }
  return "unknown";
}

absl::Status ValidateKindShape(const KindShape& shape) {
  STRATA_RETURN_IF_ERROR(CheckCount("points", shape.points.size(), kMinKindPoints, kMaxKindPoints));
  STRATA_RETURN_IF_ERROR(CheckCount("vertices", shape.vertices.size(), 0, kMaxKindVertices));
  STRATA_RETURN_IF_ERROR(CheckCount("triangles", shape.triangles.size(), 0, kMaxKindTriangles));
  STRATA_RETURN_IF_ERROR(CheckPlaces("point", shape.points));
  STRATA_RETURN_IF_ERROR(CheckPlaces("vertex", shape.vertices));
  for (std::size_t i = 0; i < shape.triangles.size(); ++i) {
    for (const std::uint32_t vertex : shape.triangles[i]) {
      if (vertex < shape.vertices.size()) continue;
      return absl::InvalidArgumentError(absl::StrCat(
          "kind: triangle ", i, " has vertex ", vertex, " of ", shape.vertices.size()));
    }
  }
  return absl::OkStatus();
}

std::string KindIdText(std::uint64_t id) { return absl::StrFormat("%012x", id); }

absl::StatusOr<KindInfo> KindCalled(const std::vector<KindInfo>& kinds, absl::string_view text) {
  const KindInfo* begun = nullptr;
  std::size_t several = 0;
  for (const KindInfo& kind : kinds) {
    if (!kind.name.empty() && kind.name == text) return kind;
    if (text.size() < kFewestDigits || !absl::StartsWith(KindIdText(kind.id), text)) continue;
    begun = &kind;
    ++several;
  }
  if (several == 1) return *begun;
  const std::string asked(text.substr(0, 100));
  if (several > 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("the ids of ", several, " kinds begin with ", asked, "; give more digits"));
  }
  return absl::NotFoundError(absl::StrCat("kind ", asked, " does not exist; see kind list"));
}

}  // namespace strata
