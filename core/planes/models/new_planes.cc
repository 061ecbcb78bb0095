#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/common/random.h"
#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/planes/models/model_selection.h"
#include "core/planes/models/plane_colour.h"
#include "core/planes/models/plane_mixture.h"
#include "core/planes/moments.h"

namespace strata {
namespace {

constexpr int kMostFailures = 40;      // draws in a row that gave no plane
constexpr double kDistanceCapM = 1.0;  // 5.4.2
constexpr double kFitCosine = 0.96;    // between a new plane and a cell of it
constexpr double kFitSigmas = 3.0;
constexpr double kFlatness = 4.0;  // of a cell that may join: second over first eigenvalue

struct Unexplained {
  std::uint32_t cell = 0;
  Eigen::Vector3d normal;
  double chance = 0.0;
};

class PlaneQueue {
 public:
  explicit PlaneQueue(const PlaneMixture& mixture) : mixture_(mixture) {
    for (std::uint32_t j = 0; j < mixture.cells().size(); ++j) {
      double explained = 0.0;
      for (const Membership& member : mixture.memberships(j)) explained += member.share;
      if (explained > 0.5) continue;
      const MixtureCell& cell = mixture.cells()[j];
      const MomentsFit fit = FitMoments(MomentsOf(1.0, Eigen::Vector3d::Zero(), cell.covariance));
      if (fit.eigenvalues(1) < kFlatness * fit.eigenvalues(0)) continue;
      at_[VoxelOf(cell.mean)].push_back(static_cast<std::uint32_t>(left_.size()));
      left_.push_back({j, fit.plane.normal, cell.measurements * Distance(j)});
    }
  }

  // A cell by chance, and the plane that grows from it over cells that nothing explains.
  MixturePlane Draw(SplitMix64& random) {
    double sum = 0.0;
    for (const Unexplained& one : left_) sum += one.chance;
    double at = random.Uniform() * sum;
    std::uint32_t seed = 0;
    while (seed + 1 < left_.size() && (at -= left_[seed].chance) > 0.0) ++seed;
    seed_ = seed;
    return Grow(seed);
  }

  // Twice the gain of the log-likelihood by the plane.
  double Gain(const MixturePlane& plane) const {
    double gain = 0.0;
    for (const std::uint32_t i : members_) {
      const MixtureCell& cell = mixture_.cells()[left_[i].cell];
      const double odds = mixture_.CellLog(cell, plane) - mixture_.ClutterLog();
      gain += 2.0 * cell.measurements * (odds > 30.0 ? odds : std::log1p(std::exp(odds)));
    }
    return gain;
  }

  void TakeMembers() {
    for (const std::uint32_t i : members_) left_[i].chance = 0.0;
  }
  void SkipSeed() { left_[seed_].chance = 0.0; }
  bool empty() const {
    return std::none_of(left_.begin(), left_.end(), [](const auto& u) { return u.chance > 0.0; });
  }

 private:
  double Distance(std::uint32_t j) const {
    const MixtureCell& cell = mixture_.cells()[j];
    double nearest = kDistanceCapM;
    for (const Membership& member : mixture_.memberships(j)) {
      const MixturePlane& plane = mixture_.planes[member.plane];
      // A colour's distance as the one in space that 5.24 puts beside it.
      const double colour = (cell.colour - plane.colour).norm() / kColourSigma;
      nearest = std::min(nearest,
                         std::hypot(strata::Distance(cell.mean, plane.plane),
                                    std::sqrt(cell.variance_m2) * colour));
    }
    return std::max(nearest, 1e-3);
  }

  bool Fits(const Unexplained& one, const MixturePlane& plane) const {
    const MixtureCell& cell = mixture_.cells()[one.cell];
    return one.chance > 0.0 && std::abs(one.normal.dot(plane.plane.normal)) >= kFitCosine &&
           strata::Distance(cell.mean, plane.plane) <= kFitSigmas * std::sqrt(cell.variance_m2) &&
           AreAlike(cell.colour, plane.colour);
  }

  MixturePlane Grow(std::uint32_t seed) {
    const auto moments = [this](std::uint32_t i) {
      const MixtureCell& cell = mixture_.cells()[left_[i].cell];
      return MomentsOf(cell.measurements / cell.variance_m2, cell.mean, cell.covariance);
    };
    members_ = {seed};
    HashSet<std::uint32_t> in = {seed};
    Eigen::Matrix4d sum = moments(seed);
    MixturePlane plane;
    plane.plane = FitMoments(sum).plane;
    plane.colour = mixture_.cells()[left_[seed].cell].colour;
    for (std::size_t next = 0; next < members_.size(); ++next) {
      const Voxel own = VoxelOf(mixture_.cells()[left_[members_[next]].cell].mean);
      for (const Voxel voxel : VoxelsAround(own)) {
        const auto found = at_.find(voxel);
        if (found == at_.end()) continue;
        for (const std::uint32_t i : found->second) {
          if (!Fits(left_[i], plane) || !in.insert(i).second) continue;
          members_.push_back(i);
          sum += moments(i);
        }
      }
      plane.plane = FitMoments(sum).plane;
      plane.voxels.push_back(own);
    }
    std::sort(plane.voxels.begin(), plane.voxels.end());
    plane.voxels.erase(std::unique(plane.voxels.begin(), plane.voxels.end()), plane.voxels.end());
    plane.chance = mixture_.MeanChance(plane.voxels.size());
    return plane;
  }

  const PlaneMixture& mixture_;
  std::vector<Unexplained> left_;
  HashMap<Voxel, std::vector<std::uint32_t>> at_;
  std::vector<std::uint32_t> members_;  // of the plane drawn last
  std::uint32_t seed_ = 0;
};

}  // namespace

absl::StatusOr<std::size_t> AddPlanes(PlaneMixture& mixture,
                                      std::size_t most,
                                      SplitMix64& random,
                                      const Stop& stop) {
  PlaneQueue queue(mixture);
  const double price = PlanePrice(mixture);
  std::vector<MixturePlane> added;
  for (int failures = 0; failures < kMostFailures && added.size() < most && !queue.empty();) {
    STRATA_RETURN_IF_ERROR(stop.status());
    MixturePlane plane = queue.Draw(random);
    if (queue.Gain(plane) > price) {
      queue.TakeMembers();
      added.push_back(std::move(plane));
      failures = 0;
    } else {
      queue.SkipSeed();
      ++failures;
    }
  }
  for (MixturePlane& plane : added) {
    mixture.AddDirection(plane.plane.normal);
    mixture.planes.push_back(std::move(plane));
  }
  if (!added.empty()) mixture.Prepare();
  return added.size();
}

}  // namespace strata
