#include "core/completion/prototype.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <tuple>
#include <utility>

#include "absl/status/status.h"
#include <Eigen/Geometry>

#include "core/common/hash_map.h"
#include "core/common/status.h"
#include "core/mesh/voxel_blocks.h"
#include "core/occupancy/voxel_walk.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr std::uint32_t kFewVotes = 2;
constexpr std::uint32_t kOneIn = 5;  // of those that could see it

// Of a plane of symmetry: where the search begins, and what it has to explain.
constexpr double kHeadingStepRad = std::numbers::pi / 60.0;
constexpr int kOffsetSteps = 12;            // of a voxel, to each side of the box's middle
constexpr std::size_t kMostSamples = 1000;  // voxels
constexpr double kMovedVoxels = 3.0;        // nearer to the plane anything is symmetric
constexpr double kLeastAgreement = 0.3;     // share of the samples whose image was measured, too
constexpr std::size_t kLeastAgreeing = 30;
constexpr std::size_t kAgreeingPerContradicting = 9;

auto PlaceOf(const Vector3i& at) { return std::tuple(at.z(), at.y(), at.x()); }

bool ByPlace(const PrototypeVoxel& a, const PrototypeVoxel& b) {
  return PlaceOf(a.at) < PlaceOf(b.at);
}

bool SeenEmpty(std::span<const ShapeView> views, const Vector3i& at) {
  return std::any_of(views.begin(), views.end(), [&](const ShapeView& view) {
    return view.At(at) == ShapeSight::kEmpty && !view.IsNear(at);
  });
}

bool AmidEmpty(std::span<const ShapeView> views, const Vector3i& at) {
  return std::any_of(
      views.begin(), views.end(), [&](const ShapeView& view) { return view.IsAmidEmpty(at); });
}

// Voxels where any view measured the thing, with the mean of its means.
std::vector<PrototypeVoxel> AnyMeasured(std::span<const ShapeView> views) {
  std::vector<PrototypeVoxel> all;
  for (const ShapeView& view : views) {
    for (const ShapeView::Voxel& voxel : view.Voxels()) all.push_back({voxel.at, voxel.mean, 1, 0});
  }
  std::stable_sort(all.begin(), all.end(), ByPlace);
  std::vector<PrototypeVoxel> measured;
  for (const PrototypeVoxel& voxel : all) {
    if (measured.empty() || measured.back().at != voxel.at) {
      measured.push_back(voxel);
      continue;
    }
    measured.back().mean += voxel.mean;
    ++measured.back().hit_by;
  }
  for (PrototypeVoxel& voxel : measured) voxel.mean /= voxel.hit_by;
  return measured;
}

void CountVotes(std::span<const ShapeView> views, PrototypeVoxel& voxel) {
  voxel.hit_by = voxel.seen_by = 0;
  for (const ShapeView& view : views) {
    const bool hit = view.IsNear(voxel.at);
    voxel.hit_by += hit ? 1 : 0;
    voxel.seen_by += hit || view.At(voxel.at) == ShapeSight::kEmpty ? 1 : 0;
  }
}

bool Counts(const PrototypeVoxel& voxel) {
  return voxel.hit_by >= std::min(kFewVotes, voxel.seen_by) &&
         kOneIn * voxel.hit_by >= voxel.seen_by;
}

// Looks for the plane by which what was measured is its own image: first by voxels that agree, then
// by how far images are from what was measured.
class MirrorSearch {
 public:
  MirrorSearch(const Prototype& prototype, std::span<const ShapeView> views)
      : voxel_m_(prototype.voxel_m), views_(views), middle_(views.front().box().center()) {
    const std::size_t every = prototype.voxels.size() / kMostSamples + 1;
    for (std::size_t i = 0; i < prototype.voxels.size(); ++i) {
      const PrototypeVoxel& voxel = prototype.voxels[i];
      ForEachAround(voxel.at, [&](const Vector3i& at) { At(at).near = true; });
      At(voxel.at).mean = voxel.mean.cast<float>();
      if (i % every == 0) samples_.push_back(voxel.mean);
    }
  }

  absl::StatusOr<std::optional<MirrorPlane>> Run(const Stop& stop) {
    for (double heading = 0.0; heading < std::numbers::pi - 1e-9; heading += kHeadingStepRad) {
      STRATA_RETURN_IF_ERROR(stop.status());
      for (int i = -kOffsetSteps; i <= kOffsetSteps; ++i) {
        Try({heading, Along(heading) + i * voxel_m_}, /*fine=*/false);
      }
    }
    if (best_score_ <= 0.0) return std::nullopt;
    best_score_ = 0.0;
    for (const double part : {0.5, 0.25, 0.125, 0.0625}) Refine(part);
    return best_;
  }

  bool IsNear(const Vector3i& at) {
    const auto* const block = nodes_.Find(BlockOf(at));
    return block != nullptr && (*block)[NodeInBlock(at)].near;
  }

 private:
  enum class Empty : std::uint8_t { kNotAsked, kNo, kYes };
  struct Node {
    bool near = false;  // something was measured in it or next to it
    Empty empty = Empty::kNotAsked;
    Eigen::Vector3f mean = Eigen::Vector3f::Constant(1e9F);  // in it
  };

  template <typename Visit>
  static void ForEachAround(const Vector3i& at, const Visit& visit) {
    for (int i = 0; i < 27; ++i) visit(at + Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
  }
  Node& At(const Vector3i& at) { return nodes_.FindOrAdd(BlockOf(at))[NodeInBlock(at)]; }

  // Asks every view once: thousands of planes are tried.
  bool IsEmpty(const Vector3d& image, const Vector3i& at) {
    if (!views_.front().box().contains(image)) return false;
    Empty& empty = At(at).empty;
    if (empty == Empty::kNotAsked) empty = SeenEmpty(views_, at) ? Empty::kYes : Empty::kNo;
    return empty == Empty::kYes;
  }

  double Along(double heading_rad) const {
    return std::cos(heading_rad) * middle_.x() + std::sin(heading_rad) * middle_.y();
  }

  // Planes are turned about the middle of what is looked at.
  void Refine(double part) {
    const MirrorPlane from = best_;
    for (int i = 0; i < 25; ++i) {
      MirrorPlane plane = from;
      plane.heading_rad += part * kHeadingStepRad * (i % 5 - 2);
      plane.offset_m += Along(plane.heading_rad) - Along(from.heading_rad);
      plane.offset_m += part * voxel_m_ * (i / 5 - 2);
      Try(plane, /*fine=*/true);
    }
  }

  // Of what lies near `image`, how near the nearest is: 1 for the same place, 0 for a voxel off.
  double Nearness(const Vector3d& image, const Vector3i& at) {
    double nearest = 1.0;
    ForEachAround(at, [&](const Vector3i& around) {
      const double squared_m2 = (At(around).mean.cast<double>() - image).squaredNorm();
      nearest = std::min(nearest, squared_m2 / (voxel_m_ * voxel_m_));
    });
    return 1.0 - nearest;
  }

  void Try(const MirrorPlane& plane, bool fine) {
    std::size_t agreeing = 0;
    std::size_t contradicting = 0;
    double score = 0.0;
    for (const Vector3d& p : samples_) {
      const Vector3d image = plane.Image(p);
      if ((image - p).norm() < 2.0 * kMovedVoxels * voxel_m_) continue;
      const Vector3i at = VoxelOf(image / voxel_m_);
      if (IsNear(at)) {
        ++agreeing;
        score += fine ? Nearness(image, at) : 1.0;
      } else if (IsEmpty(image, at)) {
        ++contradicting;
        // Whatever else agrees.
        if (kAgreeingPerContradicting * contradicting > samples_.size()) return;
      }
    }
    if (static_cast<double>(agreeing) < kLeastAgreement * static_cast<double>(samples_.size()) ||
        agreeing < std::max(kLeastAgreeing, kAgreeingPerContradicting * contradicting)) {
      return;
    }
    if (score <= best_score_) return;
    best_score_ = score;
    best_ = plane;
  }

  const double voxel_m_;
  const std::span<const ShapeView> views_;
  const Vector3d middle_;
  VoxelBlocks<Node> nodes_;
  std::vector<Vector3d> samples_;
  MirrorPlane best_;
  double best_score_ = 0.0;
};

// Adds the images of voxels to where nobody looked.
void AddImages(const MirrorPlane& plane,
               std::span<const ShapeView> views,
               MirrorSearch& search,
               Prototype& prototype) {
  std::vector<PrototypeVoxel> images;
  for (const PrototypeVoxel& voxel : prototype.voxels) {
    const Vector3d image = plane.Image(voxel.mean);
    const Vector3i at = VoxelOf(image / prototype.voxel_m);
    if (!views.front().box().contains(image) || search.IsNear(at)) continue;
    if (!SeenEmpty(views, at) && !AmidEmpty(views, at)) images.push_back({at, image, 0, 0});
  }
  std::stable_sort(images.begin(), images.end(), ByPlace);
  const auto same = [](const auto& a, const auto& b) { return a.at == b.at; };
  images.erase(std::unique(images.begin(), images.end(), same), images.end());
  prototype.voxels.insert(prototype.voxels.end(), images.begin(), images.end());
  std::sort(prototype.voxels.begin(), prototype.voxels.end(), ByPlace);
}

}  // namespace

Vector3d MirrorPlane::Image(const Vector3d& p) const {
  const Vector3d n(std::cos(heading_rad), std::sin(heading_rad), 0.0);
  return p - 2.0 * (n.dot(p) - offset_m) * n;
}

absl::StatusOr<Prototype> BuildPrototype(std::span<const ShapeView> views, const Stop& stop) {
  if (views.empty()) return absl::InvalidArgumentError("prototype: of no thing");
  Prototype prototype;
  prototype.voxel_m = views.front().voxel_m();
  for (PrototypeVoxel& voxel : AnyMeasured(views)) {
    STRATA_RETURN_IF_ERROR(stop.status());
    CountVotes(views, voxel);
    if (Counts(voxel)) prototype.voxels.push_back(voxel);
  }
  MirrorSearch search(prototype, views);
  STRATA_ASSIGN_OR_RETURN(prototype.mirror, search.Run(stop));
  if (prototype.mirror.has_value()) AddImages(*prototype.mirror, views, search, prototype);
  return prototype;
}

Inference InferHidden(const Prototype& prototype, const ShapeView& view) {
  Inference hidden;
  for (const PrototypeVoxel& voxel : prototype.voxels) {
    if (view.IsNear(voxel.at)) {
      ++hidden.agreeing;
      continue;
    }
    const ShapeSight sight = view.At(voxel.at);
    if (sight == ShapeSight::kEmpty) ++hidden.contradicting;
    if (sight != ShapeSight::kHidden || view.IsAmidEmpty(voxel.at)) continue;
    if (view.IsBesideEmpty(voxel.mean)) continue;
    hidden.points.push_back(voxel.mean);
  }
  hidden.voxels = prototype.voxels.size();
  if (!hidden.IsOfKind() || !hidden.IsSeenEnough()) hidden.points.clear();
  return hidden;
}

}  // namespace strata
