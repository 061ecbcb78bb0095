#include "client/cli/mesh/mesh_maker.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>

#include "client/cli/mesh/distance_mesh.h"
#include "client/cli/mesh/scan_loop.h"
#include "core/common/status.h"
#include "core/mesh/alpha_shape.h"
#include "core/mesh/density_contour.h"
#include "core/mesh/organised_mesh.h"
#include "core/mesh/point_thinner.h"
#include "core/mesh/vertex_colours.h"

namespace strata::cli {
namespace {

// Voxels within which a point colours a vertex: a contour lies two before its points.
constexpr double kColourReach = 2.5;

absl::StatusOr<ThinnedPoints> Thin(Context& context,
                                   const ScanClouds& clouds,
                                   const MeshOptions& options,
                                   double edge_m) {
  PointThinnerOptions thinner_options;
  thinner_options.edge_m = edge_m;
  if (options.region.has_value()) thinner_options.region = *options.region;
  STRATA_RETURN_IF_ERROR(thinner_options.Validate());
  PointThinner thinner(thinner_options);
  ScanLoop loop(context, clouds, 1);
  STRATA_RETURN_IF_ERROR(loop.ForEach("points", [&](PosedCloud& posed) {
    clouds.KeepClass(posed.cloud);
    return thinner.Add(posed.cloud, posed.T_map_scan, posed.sensor, context.call.stop);
  }));
  return thinner.Points();
}

absl::StatusOr<MadeMesh> ByContour(Context& context,
                                   const ScanClouds& clouds,
                                   const MeshOptions& options) {
  // Finer than the voxels, so that their counts tell a surface from single points.
  STRATA_ASSIGN_OR_RETURN(const ThinnedPoints thinned,
                          Thin(context, clouds, options, options.voxel_m / 2.0));
  DensityContourOptions contour;
  contour.voxel_m = options.voxel_m;
  MadeMesh made;
  made.points = thinned.points.size();
  STRATA_ASSIGN_OR_RETURN(made.mesh, ContourDensity(thinned.points, contour, context.call.stop));
  return made;
}

absl::StatusOr<MadeMesh> ByAlphaShape(Context& context,
                                      const ScanClouds& clouds,
                                      const MeshOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const ThinnedPoints thinned,
                          Thin(context, clouds, options, options.voxel_m));
  const AlphaShapeOptions shape_options{.towards = thinned.towards, .spacing_m = options.voxel_m};
  STRATA_ASSIGN_OR_RETURN(AlphaShape shape,
                          MakeAlphaShape(thinned.points, shape_options, context.call.stop));
  return MadeMesh{std::move(shape.mesh), thinned.points.size(), shape.alpha_m2};
}

absl::StatusOr<MadeMesh> ByGrid(Context& context, const ScanClouds& clouds) {
  STRATA_ASSIGN_OR_RETURN(PosedCloud posed, clouds.Read(context, 0));
  clouds.KeepClass(posed.cloud);
  MadeMesh made;
  made.points = CountFinite(posed.cloud);
  STRATA_ASSIGN_OR_RETURN(made.mesh, MeshOrganised(posed.cloud));
  return made;
}

absl::StatusOr<MadeMesh> ByMethod(Context& context,
                                  const ScanClouds& clouds,
                                  const MeshOptions& options) {
  if (options.method == "organised") return ByGrid(context, clouds);
  if (options.method == "contour") return ByContour(context, clouds, options);
  if (options.method == "alpha") return ByAlphaShape(context, clouds, options);
  return MakeDistanceMesh(context, clouds, options);
}

}  // namespace

absl::StatusOr<MadeMesh> MakeMesh(Context& context,
                                  const ScanClouds& clouds,
                                  const MeshOptions& options) {
  STRATA_ASSIGN_OR_RETURN(MadeMesh made, ByMethod(context, clouds, options));
  const char* const where = options.region.has_value() ? " in the region" : "";
  const char* const what = options.class_name.empty() ? "" : " of that class";
  if (made.points == 0) {
    return absl::NotFoundError(absl::StrCat("no points", what, where, " to mesh"));
  }
  if (made.mesh.triangles.empty()) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "%d points%s%s make no triangle: they are too few or too far apart for voxels of %g m; "
        "larger ones may do",
        made.points,
        what,
        where,
        options.voxel_m));
  }
  return made;
}

absl::Status ColourMesh(Context& context,
                        const ScanClouds& clouds,
                        const MeshOptions& options,
                        TriangleMesh& mesh) {
  // Those of the scan's grid have their points'.
  if (!clouds.has_colour() || options.method == "organised") return absl::OkStatus();
  VertexColours colours(mesh, kColourReach * options.voxel_m);
  ScanLoop loop(context, clouds, 1);
  STRATA_RETURN_IF_ERROR(loop.ForEach("colours", [&](PosedCloud& posed) {
    clouds.KeepClass(posed.cloud);
    return colours.Add(posed.cloud, posed.T_map_scan, context.call.stop);
  }));
  mesh.colour = colours.Colours();
  return absl::OkStatus();
}

}  // namespace strata::cli
