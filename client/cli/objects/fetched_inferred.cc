#include "client/cli/objects/fetched_inferred.h"

#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "client/cli/terminal/stale.h"
#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

constexpr Colour kInferredColour{214, 39, 40};
constexpr double kInferredWidthPixels = 1.0;
const Eigen::Vector3d kHatch(0.04, 0.04, 0.0);  // half a stroke [m]

Geometry InferredGeometry(const FetchedInferred& fetched) {
  Geometry geometry;
  for (const InferredPart& part : fetched.parts) {
    for (const Eigen::Vector3d& p : part.points) {
      geometry.vertices.push_back(p);
      geometry.label.push_back(static_cast<std::uint16_t>(part.entity));
    }
  }
  return geometry;
}

}  // namespace

absl::StatusOr<FetchedInferred> FetchInferred(Context& context,
                                              const std::string& map,
                                              EntityQuery query,
                                              const std::string& class_name) {
  FetchedInferred fetched;
  if (!class_name.empty()) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes,
                            context.database.maps().ListClasses(context.call, map));
    STRATA_ASSIGN_OR_RETURN(query.class_id, ClassIdOf(classes, class_name));
  }
  STRATA_ASSIGN_OR_RETURN(fetched.info,
                          context.database.objects().ListInferred(
                              context.call, map, query, [&](const InferredPart& part) {
                                fetched.points += part.points.size();
                                fetched.parts.push_back(part);
                                return absl::OkStatus();
                              }));
  STRATA_ASSIGN_OR_RETURN(fetched.stale,
                          IsOfEarlierState(context,
                                           map,
                                           {fetched.info.epoch},
                                           "what was inferred is",
                                           "objects find and objects complete make it anew"));
  return fetched;
}

absl::Status WriteInferred(const std::filesystem::path& path, const FetchedInferred& fetched) {
  const std::string ending = absl::AsciiStrToLower(path.extension().string());
  if (ending != ".ply" && ending != ".pcd") {
    return absl::InvalidArgumentError(absl::StrCat(
        "what was inferred is written as .ply and .pcd, and drawn by map render --inferred; got ",
        path.string()));
  }
  const Geometry geometry = InferredGeometry(fetched);
  STRATA_ASSIGN_OR_RETURN(const std::string bytes,
                          ending == ".ply" ? PlyBytes(geometry) : PcdBytes(geometry));
  return WriteFileBytes(path, bytes);
}

void AddInferred(const FetchedInferred& fetched, picture::Overlay& overlay) {
  for (const InferredPart& part : fetched.parts) {
    for (const Eigen::Vector3d& p : part.points) {
      overlay.strokes.push_back({{p - kHatch, p + kHatch}, kInferredColour, kInferredWidthPixels});
    }
  }
  overlay.legend.emplace_back(kInferredColour, absl::StrCat("inferred, ", fetched.points));
}

}  // namespace strata::cli
