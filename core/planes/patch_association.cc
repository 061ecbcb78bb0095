#include "core/planes/patch_association.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/geometry/primitives.h"
#include "core/planes/moments.h"
#include "core/planes/posed_patch.h"
#include "core/planes/scan_planes.h"
#include "core/planes/shared_planes.h"

namespace strata {
namespace {

constexpr double kCubeM = 8.0;
// Ratio of areas: a much smaller patch brings no larger one in (it may bridge a kerb), and in the
// same scan neither wins against it nor makes a draw.
constexpr double kMinShare = 0.25;
constexpr double kByFar = 2.0;
// Surfaces bend the same way for all that see them: what that puts a view off by does not average
// out over the scans of a plane, nor over the planes along a way. In squares.
constexpr double kBias = 4.0;
// A patch so many times as far from the plane as the others are is more likely none of it, and is
// farther off than surfaces wave.
constexpr double kOff = 2.0;
constexpr double kFarOff = 6.0;
// Where fewer scans see a plane nobody knows which of them is off.
constexpr double kEnoughScans = 8.0;

// Patches by the cubes of space that their boxes touch.
class PatchIndex {
 public:
  explicit PatchIndex(std::span<const PosedPatch> patches) {
    for (std::uint32_t i = 0; i < patches.size(); ++i) {
      ForCubes(patches[i].box, [&](const Cube& cube) { cubes_[cube].push_back(i); });
    }
  }

  // Those that may touch the box and that are wanted, ascending.
  template <typename IsWanted>
  std::vector<std::uint32_t> Near(const Eigen::AlignedBox3d& box, IsWanted is_wanted) const {
    std::vector<std::uint32_t> near;
    ForCubes(box, [&](const Cube& cube) {
      const auto found = cubes_.find(cube);
      if (found == cubes_.end()) return;
      std::ranges::copy_if(found->second, std::back_inserter(near), is_wanted);
    });
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    return near;
  }

 private:
  using Cube = std::array<std::int64_t, 3>;
  template <typename Visit>
  static void ForCubes(const Eigen::AlignedBox3d& box, Visit visit) {
    const Eigen::Vector3d low = (box.min() / kCubeM).array().floor();
    const Eigen::Vector3d high = (box.max() / kCubeM).array().floor();
    for (auto x = static_cast<std::int64_t>(low.x()); x <= static_cast<std::int64_t>(high.x());
         ++x) {
      for (auto y = static_cast<std::int64_t>(low.y()); y <= static_cast<std::int64_t>(high.y());
           ++y) {
        for (auto z = static_cast<std::int64_t>(low.z()); z <= static_cast<std::int64_t>(high.z());
             ++z) {
          visit(Cube{x, y, z});
        }
      }
    }
  }
  HashMap<Cube, std::vector<std::uint32_t>> cubes_;
};

// What patches say together.
class PatchSum {
 public:
  void Add(const PosedPatch& patch) {
    if (scans_.empty()) side_ = patch.plane.normal;
    information_ += patch.information;
    scans_.insert(patch.scan);
  }
  bool empty() const { return scans_.empty(); }
  std::size_t scan_count() const { return scans_.size(); }

  // The normal to the side of the patches'. REQUIRES: not empty.
  JointPlane Joint() const {
    const MomentsFit fit = FitMoments(information_);
    JointPlane joint{
        .plane = fit.plane, .mean = fit.mean, .scans = static_cast<double>(scans_.size())};
    if (joint.plane.normal.dot(side_) < 0.0) {
      joint.plane = {.normal = -joint.plane.normal, .distance = -joint.plane.distance};
    }
    return joint;
  }

 private:
  Eigen::Matrix4d information_ = Eigen::Matrix4d::Zero();
  Eigen::Vector3d side_ = Eigen::Vector3d::Zero();
  std::set<std::size_t> scans_;
};

class PatchAssociation {
 public:
  PatchAssociation(std::vector<PosedPatch> patches, const SharedPlaneOptions& options)
      : patches_(std::move(patches)),
        options_(options),
        index_(patches_),
        taken_(patches_.size(), false),
        seen_by_(patches_.size(), 0) {
    for (const PosedPatch& patch : patches_) briefs_.push_back(BriefOf(patch, options_));
  }

  std::vector<SharedPlane> Run() {
    std::vector<std::uint32_t> order(patches_.size());
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(), [this](std::uint32_t a, std::uint32_t b) {
      return patches_[a].patch->area_m2 > patches_[b].patch->area_m2;
    });
    std::vector<SharedPlane> planes;
    for (const std::uint32_t seed : order) {
      if (taken_[seed]) continue;
      std::vector<std::uint32_t> rivals;
      std::vector<std::uint32_t> group = Grow(seed, rivals);
      SettleRivals(rivals, group);
      KeepWhatFits(group);
      if (SumOf(group).scan_count() < 2) continue;
      for (const std::uint32_t i : group) taken_[i] = true;
      planes.push_back(PlaneOfGroup(group));
    }
    return planes;
  }

 private:
  // `rivals` gets patches that would fit as well, but for another one of their scan.
  std::vector<std::uint32_t> Grow(std::uint32_t seed, std::vector<std::uint32_t>& rivals) {
    ++seeds_;
    std::vector<std::uint32_t> group = {seed};
    seen_by_[seed] = seeds_;
    PatchSum sum;
    sum.Add(patches_[seed]);
    JointPlane joint = sum.Joint();
    for (std::size_t next = 0; next < group.size(); ++next) {
      const PosedPatch& member = patches_[group[next]];
      const auto is_open = [&](std::uint32_t i) { return !taken_[i] && seen_by_[i] != seeds_; };
      for (const std::uint32_t i : index_.Near(member.box, is_open)) {
        if (member.patch->area_m2 < kMinShare * briefs_[i].area_m2 ||
            !MayFit(briefs_[i], joint, options_)) {
          continue;
        }
        const PosedPatch& candidate = patches_[i];
        if (Distance(candidate.centroid, patches_[seed].centroid) > options_.max_extent_m ||
            BentAway(candidate, patches_[seed].centroid) > options_.sigma_floor_m ||
            !Fits(candidate, joint, options_) ||
            !Overlap(candidate, member, options_.min_overlap)) {
          continue;
        }
        seen_by_[i] = seeds_;
        if (!AgreesWithItsScan(candidate, group)) {
          rivals.push_back(i);
          continue;
        }
        group.push_back(i);
        sum.Add(candidate);
        joint = sum.Joint();
      }
    }
    return group;
  }

  bool AgreesWithItsScan(const PosedPatch& candidate, std::span<const std::uint32_t> group) const {
    return std::all_of(group.begin(), group.end(), [&](std::uint32_t i) {
      return patches_[i].scan != candidate.scan ||
             Coplanar(patches_[i], candidate, options_.sigma_floor_m);
    });
  }

  // Poses cannot say which of several surfaces of one scan is the group's (a floor and a ramp, a
  // road and its kerb): the nearest to what the other scans saw is, if by far, and otherwise none.
  void SettleRivals(const std::vector<std::uint32_t>& rivals, std::vector<std::uint32_t>& group) {
    std::map<std::size_t, std::vector<std::uint32_t>> of_scan;
    for (const std::uint32_t i : rivals) of_scan[patches_[i].scan].push_back(i);
    for (auto& [scan, contenders] : of_scan) {
      const auto own =
          std::stable_partition(group.begin(), group.end(), [&, scan = scan](std::uint32_t i) {
            return patches_[i].scan != scan;
          });
      contenders.insert(contenders.end(), own, group.end());
      group.erase(own, group.end());
      if (group.empty()) return;
      const std::vector<std::uint32_t> nearest =
          NearestByFar(contenders, SumOf(group).Joint().plane);
      group.insert(group.end(), nearest.begin(), nearest.end());
    }
  }

  PatchSum SumOf(std::span<const std::uint32_t> group) const {
    PatchSum sum;
    for (const std::uint32_t i : group) sum.Add(patches_[i]);
    return sum;
  }

  // Empty when it is a draw.
  std::vector<std::uint32_t> NearestByFar(std::vector<std::uint32_t> contenders,
                                          const Plane& plane) const {
    double largest = 0.0;
    for (const std::uint32_t i : contenders) {
      largest = std::max(largest, patches_[i].patch->area_m2);
    }
    std::erase_if(contenders, [&](std::uint32_t i) {
      return patches_[i].patch->area_m2 < kMinShare * largest;
    });
    const auto distance = [&](std::uint32_t i) {
      return RmsDistance(patches_[i].information, plane);
    };
    std::sort(contenders.begin(), contenders.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(distance(a), a) < std::pair(distance(b), b);
    });
    const PosedPatch& best = patches_[contenders.front()];
    std::vector<std::uint32_t> nearest;
    for (const std::uint32_t i : contenders) {
      if (Coplanar(patches_[i], best, options_.sigma_floor_m)) {
        nearest.push_back(i);
      } else if (distance(i) < kByFar * distance(contenders.front())) {
        return {};
      }
    }
    return nearest;
  }

  // While a patch does not fit the plane of all other scans, the farthest such leaves.
  void KeepWhatFits(std::vector<std::uint32_t>& group) const {
    while (SumOf(group).scan_count() >= 2) {
      std::map<std::size_t, PatchSum> others;  // of what the other scans say
      for (const std::uint32_t i : group) others[patches_[i].scan];
      for (auto& [scan, sum] : others) {
        for (const std::uint32_t i : group) {
          if (patches_[i].scan != scan) sum.Add(patches_[i]);
        }
      }
      std::map<std::size_t, JointPlane> joints;
      for (const auto& [scan, sum] : others) joints[scan] = sum.Joint();
      std::size_t worst = group.size();
      double worst_rms = 0.0;
      for (std::size_t k = 0; k < group.size(); ++k) {
        const PosedPatch& patch = patches_[group[k]];
        const JointPlane& joint = joints.at(patch.scan);
        if (Fits(patch, joint, options_)) continue;
        const double rms = RmsDistance(patch.information, joint.plane);
        if (worst == group.size() || rms > worst_rms) {
          worst = k;
          worst_rms = rms;
        }
      }
      if (worst == group.size()) return;
      group.erase(group.begin() + static_cast<std::ptrdiff_t>(worst));
    }
  }

  // Square of what a patch's distance to the plane exceeds its own spread by [m²].
  static double Excess(const PosedPatch& patch, const Plane& plane) {
    const double own = RmsDistance(patch.information, patch.plane);
    const double rms = RmsDistance(patch.information, plane);
    return std::max(0.0, rms * rms - own * own);
  }

  // A plane, and the mean square of what its patches' distances to it exceed their own spread by.
  struct Consensus {
    JointPlane joint;
    double disagreement_m2 = 0.0;
  };

  Consensus ConsensusOf(std::span<const std::uint32_t> group) const {
    Consensus consensus{.joint = SumOf(group).Joint()};
    double sum = 0.0;
    double weight = 0.0;
    for (const std::uint32_t i : group) {
      sum += patches_[i].measurements * Excess(patches_[i], consensus.joint.plane);
      weight += patches_[i].measurements;
    }
    consensus.disagreement_m2 = sum / weight;
    return consensus;
  }

  // Of all but what is far off, if that is less than half: it would bend the plane to itself, and
  // all the others would seem to be off by that. Least trimmed squares (Rousseeuw 1984).
  Consensus ConsensusOfMost(std::span<const std::uint32_t> group) const {
    Consensus consensus = ConsensusOf(group);
    if (consensus.joint.scans < kEnoughScans) return consensus;
    std::vector<std::uint32_t> most;
    for (int step = 0; step < 2; ++step) {
      most = NearerHalf(group, consensus.joint.plane);
      consensus = ConsensusOf(most);
    }
    for (;;) {
      const double limit_m2 = std::max(kFarOff * kFarOff * consensus.disagreement_m2,
                                       options_.sigma_floor_m * options_.sigma_floor_m);
      std::vector<std::uint32_t> more;
      std::ranges::copy_if(group, std::back_inserter(more), [&](std::uint32_t i) {
        return Excess(patches_[i], consensus.joint.plane) <= limit_m2;
      });
      if (more.size() <= most.size()) return consensus;
      most = std::move(more);
      consensus = ConsensusOf(most);
    }
  }

  std::vector<std::uint32_t> NearerHalf(std::span<const std::uint32_t> group,
                                        const Plane& plane) const {
    std::vector<std::pair<double, std::uint32_t>> by_excess;
    for (const std::uint32_t i : group) by_excess.emplace_back(Excess(patches_[i], plane), i);
    std::sort(by_excess.begin(), by_excess.end());
    std::vector<std::uint32_t> half;
    for (std::size_t k = 0; 2 * k < group.size(); ++k) half.push_back(by_excess[k].second);
    return half;
  }

  SharedPlane PlaneOfGroup(std::span<const std::uint32_t> group) const {
    SharedPlane shared;
    const auto [joint, disagreement_m2] = ConsensusOfMost(group);
    shared.plane = joint.plane;
    std::map<std::size_t, SharedPlane::View> views;
    for (const std::uint32_t i : group) {
      const PosedPatch& p = patches_[i];
      SharedPlane::View& view =
          views
              .try_emplace(p.scan,
                           SharedPlane::View{.scan = p.scan, .moments = Eigen::Matrix4d::Zero()})
              .first->second;
      const double excess = Excess(p, shared.plane);
      const double doubt = excess > kOff * kOff * disagreement_m2 ? excess : disagreement_m2;
      const double bent = BentAway(p, joint.mean);
      const double weight =
          p.measurements / (p.variance_m2 + doubt + kBias * joint.scans * bent * bent);
      view.moments += weight / p.patch->moments(3, 3) * p.patch->moments;
      view.weight += p.patch->area_m2;
      view.rms_m += p.patch->area_m2 * std::pow(RmsDistance(p.information, shared.plane), 2);
      shared.support_value += p.patch->area_m2;
    }
    for (auto& [scan, view] : views) {
      view.rms_m = std::sqrt(view.rms_m / view.weight);
      shared.views.push_back(view);
    }
    return shared;
  }

  std::vector<PosedPatch> patches_;
  const SharedPlaneOptions& options_;
  PatchIndex index_;
  std::vector<PatchBrief> briefs_;  // beside patches_
  std::vector<bool> taken_;
  std::vector<std::uint32_t> seen_by_;  // the last seed that has this patch or refused it
  std::uint32_t seeds_ = 0;
};

}  // namespace

std::vector<SharedPlane> FindPatchPlanes(std::span<const PosedPlanes> scans,
                                         const SharedPlaneOptions& options) {
  std::vector<PosedPatch> patches;
  for (std::size_t scan = 0; scan < scans.size(); ++scan) {
    for (const PlanePatch& patch : scans[scan].planes->patches) {
      patches.push_back(InMap(patch, scan, scans[scan].T_map_scan, options));
    }
  }
  return PatchAssociation(std::move(patches), options).Run();
}

}  // namespace strata
