#include "core/completion/shape_view.h"

#include <algorithm>
#include <tuple>

#include "absl/strings/str_format.h"

#include "core/occupancy/voxel_walk.h"

namespace strata {

using Eigen::Vector3d;
using Eigen::Vector3i;

namespace {

constexpr double kBeamM = 0.01;  // half of a beam's width, some metres away
constexpr double kMostOfVoxel = 0.34;

// The voxel itself, 13, and the 26 around it.
Vector3i Around(int i) { return {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1}; }

}  // namespace

absl::StatusOr<ShapeView> ShapeView::Over(const Eigen::AlignedBox3d& box, double voxel_m) {
  if (!(voxel_m >= 0.005 && voxel_m <= 1.0)) {
    return absl::InvalidArgumentError(
        absl::StrFormat("shape: voxel_m = %g is not in [0.005, 1]", voxel_m));
  }
  const bool finite = box.min().allFinite() && box.max().allFinite();
  const double farthest =
      std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  if (!finite || box.isEmpty() || farthest >= kMaxVoxel * voxel_m) {
    return absl::InvalidArgumentError(
        absl::StrFormat("shape: its box is empty, or reaches beyond ±%g m", kMaxVoxel * voxel_m));
  }
  const double voxels = (box.sizes() / voxel_m).array().ceil().prod();
  if (voxels > kMostShapeVoxels) {
    return absl::InvalidArgumentError(
        absl::StrFormat("shape: %.0f voxels of %g m, at most %.0f; take larger ones",
                        voxels,
                        voxel_m,
                        kMostShapeVoxels));
  }
  OccupancyVoxelsOptions options;
  options.voxel_m = voxel_m;
  options.region = box;
  return ShapeView(box, options);
}

void ShapeView::AddPoints(std::span<const Vector3d> points) {
  for (const Vector3d& p : points) {
    if (!box_.contains(p)) continue;
    const Vector3d in_voxels = p / voxel_m();
    const Vector3i at = VoxelOf(in_voxels);
    Sum& sum = thing_.FindOrAdd(BlockOf(at))[NodeInBlock(at)];
    sum.offset += (in_voxels - at.cast<double>()).cast<float>();
    ++sum.points;
  }
}

absl::Status ShapeView::AddScan(const PointCloud& cloud,
                                const Pose& T_kind_scan,
                                const SensorModel& sensor,
                                const Stop& stop) {
  return grid_.Add(cloud, T_kind_scan, sensor, stop);
}

std::vector<ShapeView::Voxel> ShapeView::Voxels() const {
  std::vector<Voxel> voxels;
  for (std::size_t i = 0; i < thing_.size(); ++i) {
    const BlockKey& key = thing_.keys()[i];
    for (int node = 0; node < static_cast<int>(kBlockNodes); ++node) {
      const Sum& sum = thing_.block(i)[static_cast<std::size_t>(node)];
      if (sum.points == 0) continue;
      const Vector3i at =
          kBlockEdge * Vector3i(key.x, key.y, key.z) + Vector3i(node & 7, node >> 3 & 7, node >> 6);
      const Vector3d offset = sum.offset.cast<double>() / sum.points;
      voxels.push_back({at, voxel_m() * (at.cast<double>() + offset)});
    }
  }
  const auto place = [](const Voxel& v) { return std::tuple(v.at.z(), v.at.y(), v.at.x()); };
  std::sort(voxels.begin(), voxels.end(), [&](const Voxel& a, const Voxel& b) {
    return place(a) < place(b);
  });
  return voxels;
}

bool ShapeView::IsThing(const Vector3i& voxel) const {
  const auto* const block = thing_.Peek(BlockOf(voxel));
  return block != nullptr && (*block)[NodeInBlock(voxel)].points > 0;
}

bool ShapeView::IsNear(const Vector3i& voxel) const {
  for (int i = 0; i < 27; ++i) {
    if (IsThing(voxel + Around(i))) return true;
  }
  return false;
}

bool ShapeView::IsAmidEmpty(const Vector3i& voxel) const {
  int empty = 0;
  for (int i = 0; i < 27; ++i) {
    empty += i != 13 && At(voxel + Around(i)) == ShapeSight::kEmpty ? 1 : 0;
  }
  return 3 * empty >= 2 * 26;
}

bool ShapeView::IsBesideEmpty(const Vector3d& p) const {
  const double reach = std::min(kBeamM, kMostOfVoxel * voxel_m());
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner(i & 1 ? reach : -reach, i & 2 ? reach : -reach, i & 4 ? reach : -reach);
    if (At(VoxelOf((p + corner) / voxel_m())) == ShapeSight::kEmpty) return true;
  }
  return false;
}

ShapeSight ShapeView::At(const Vector3i& voxel) const {
  if (IsThing(voxel)) return ShapeSight::kThing;
  const std::int16_t odds = OccupancyReader(grid_).Odds(voxel);
  if (odds == OccupancyVoxels::kUnknownOdds) return ShapeSight::kHidden;
  return odds < 0 ? ShapeSight::kEmpty : ShapeSight::kOther;
}

}  // namespace strata
