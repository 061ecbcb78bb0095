#include "client/cli/mesh/distance_mesh.h"

#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/strings/str_format.h"

#include "client/cli/mesh/scan_loop.h"
#include "core/common/status.h"
#include "core/mesh/distance_field.h"
#include "core/mesh/mesh_parts.h"

namespace strata::cli {
namespace {

// Of the field of a part: the mesh of all grows beside it.
constexpr std::size_t kPartBytes = std::size_t{256} << 20;
// Blocks with points that such a field mostly has room for.
constexpr std::size_t kPartBlocks = 24'000;
// The same of a field of all.
constexpr std::size_t kWholeBlocks = 60'000;
// Some 60 bytes each in memory, and as many again while they are written.
constexpr std::size_t kMostTriangles = 40'000'000;

// Of the scans that `wants` takes; without triangles where they have no points.
absl::StatusOr<TriangleMesh> MeshOfField(DistanceField& field,
                                         ScanLoop& loop,
                                         const ScanClouds& clouds,
                                         const Stop& stop,
                                         absl::FunctionRef<bool(std::size_t)> wants) {
  STRATA_RETURN_IF_ERROR(loop.ForSome("surfaces", wants, [&](PosedCloud& posed) {
    clouds.KeepClass(posed.cloud);
    return field.Add(posed.cloud, posed.T_map_scan, posed.sensor, stop);
  }));
  if (field.bytes() == 0) return TriangleMesh();
  STRATA_RETURN_IF_ERROR(loop.ForSome("free space", wants, [&](const PosedCloud& posed) {
    return field.Carve(posed.cloud, posed.T_map_scan, posed.sensor, stop);
  }));
  return field.Mesh(stop);
}

// Two digits, upwards.
double RoundedUp(double metres) {
  const double unit = std::pow(10.0, std::floor(std::log10(metres)) - 1.0);
  return std::ceil(metres / unit) * unit;
}

// Where the points of all scans lie, and the whole field's first node.
absl::StatusOr<MeshCutter> CutterOf(ScanLoop& loop,
                                    const ScanClouds& clouds,
                                    const DistanceFieldOptions& options,
                                    const Stop& stop) {
  std::optional<MeshCutter> cutter;
  STRATA_RETURN_IF_ERROR(loop.ForEach("extent", [&](PosedCloud& posed) {
    if (!cutter.has_value()) {
      cutter.emplace(DistanceField::OriginFor(posed.cloud, posed.T_map_scan, options.voxel_m),
                     options.voxel_m,
                     options.region);
    }
    clouds.KeepClass(posed.cloud);
    return cutter->Add(posed.cloud, posed.T_map_scan, stop);
  }));
  return *std::move(cutter);
}

// One part after the other, each with a field of its own.
class MeshInParts {
 public:
  MeshInParts(ScanLoop& loop,
              const ScanClouds& clouds,
              const MeshCutter& cutter,
              const DistanceFieldOptions& options,
              const Stop& stop)
      : loop_(loop),
        clouds_(clouds),
        cutter_(cutter),
        options_(options),
        stop_(stop),
        joiner_(options.voxel_m) {
    options_.max_bytes = kPartBytes;
  }

  absl::StatusOr<TriangleMesh> Make() {
    std::vector<FieldPart> parts = cutter_.Parts(kPartBlocks);
    loop_.AddRounds(2 * (parts.size() - 1));  // two it counts already
    std::size_t made = 0;
    while (!parts.empty()) {
      const FieldPart part = parts.back();
      parts.pop_back();
      const absl::Status added = AddPart(part);
      if (!added.ok() && overflowed_ && !IsOneBlock(part)) {
        for (const FieldPart& half : Halves(part)) parts.push_back(half);
        loop_.AddRounds(3);
        continue;
      }
      ++made;
      if (full_) {
        return TooMany(static_cast<double>(made + parts.size()) / static_cast<double>(made));
      }
      STRATA_RETURN_IF_ERROR(added);
    }
    return joiner_.Finish();
  }

 private:
  absl::Status AddPart(const FieldPart& part) {
    options_.part = part;
    DistanceField field(options_);
    const absl::StatusOr<TriangleMesh> mesh =
        MeshOfField(field, loop_, clouds_, stop_, [&](std::size_t scan) {
          return cutter_.Reaches(scan, part);
        });
    overflowed_ = field.bytes() > kPartBytes;
    STRATA_RETURN_IF_ERROR(mesh.status());
    const absl::Status joined = joiner_.Append(*mesh, part, kMostTriangles);
    full_ = !joined.ok();
    return joined;
  }

  // `times`: as many as are made already.
  absl::Status TooMany(double times) const {
    return absl::ResourceExhaustedError(
        absl::StrFormat("the mesh would have more than %d triangles: mesh a region of the map, or "
                        "with --voxel %g",
                        kMostTriangles,
                        RoundedUp(options_.voxel_m * std::sqrt(1.1 * times))));
  }

  ScanLoop& loop_;
  const ScanClouds& clouds_;
  const MeshCutter& cutter_;
  DistanceFieldOptions options_;
  const Stop& stop_;
  MeshJoiner joiner_;
  bool overflowed_ = false;  // the last part's field
  bool full_ = false;        // there are too many triangles
};

}  // namespace

absl::StatusOr<MadeMesh> MakeDistanceMesh(Context& context,
                                          const ScanClouds& clouds,
                                          const MeshOptions& options) {
  DistanceFieldOptions field_options;
  field_options.voxel_m = options.voxel_m;
  if (options.region.has_value()) field_options.region = *options.region;
  STRATA_RETURN_IF_ERROR(field_options.Validate());
  const Stop& stop = context.call.stop;
  ScanLoop loop(context, clouds, 3);
  STRATA_ASSIGN_OR_RETURN(const MeshCutter cutter, CutterOf(loop, clouds, field_options, stop));
  MadeMesh made;
  made.points = cutter.points();
  if (cutter.points() == 0) return made;
  if (cutter.blocks() <= kWholeBlocks) {
    DistanceField field(field_options);
    absl::StatusOr<TriangleMesh> mesh =
        MeshOfField(field, loop, clouds, stop, [](std::size_t /*scan*/) { return true; });
    if (field.bytes() <= field_options.max_bytes) {
      if (mesh.ok()) made.mesh = *std::move(mesh);
      return mesh.ok() ? absl::StatusOr<MadeMesh>(std::move(made)) : mesh.status();
    }
    loop.AddRounds(2);
  }
  STRATA_ASSIGN_OR_RETURN(made.mesh, MeshInParts(loop, clouds, cutter, field_options, stop).Make());
  return made;
}

}  // namespace strata::cli
