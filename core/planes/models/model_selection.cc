#include "core/planes/models/model_selection.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/random.h"
#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/planes/models/plane_colour.h"
#include "core/planes/models/plane_mixture.h"
#include "core/planes/moments.h"

namespace strata {
namespace {

constexpr double kPlaneParameters = 3.0;
constexpr double kColourParameters = 3.0;     // of a plane, where colours count
constexpr double kDirectionParameters = 3.0;  // its chance among them
constexpr double kMergeSigmas = 4.0;          // of a direction, between two that may be one
constexpr double kOnePlaneCosine = 0.99;      // the same where nothing else is in question
constexpr double kMergeCosine = 0.9;          // between the normals of planes that may be one

double LogN(const PlaneMixture& mixture) { return std::log(std::max(2.0, mixture.measurements())); }

std::vector<Voxel> Union(const std::vector<Voxel>& a, const std::vector<Voxel>& b) {
  std::vector<Voxel> all;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  return all;
}

std::size_t UnionSize(const std::vector<Voxel>& a, const std::vector<Voxel>& b) {
  std::size_t both = 0;
  auto i = a.begin();
  for (auto j = b.begin(); i != a.end() && j != b.end();) {
    if (*i == *j) ++both;
    const bool step_a = *i <= *j, step_b = *j <= *i;
    if (step_a) ++i;
    if (step_b) ++j;
  }
  return a.size() + b.size() - both;
}

// One plane less: `gone` is left out, or goes into `into`, which becomes `plane`.
struct Reduction {
  std::size_t gone = 0;
  std::optional<std::size_t> into;
  Plane plane;
  LabColour colour = LabColour::Zero();
  double bic_change = 0.0;
};

// The likelihood of the cells around planes, and what it would be without some of them.
class LeaveOneOut {
 public:
  LeaveOneOut(const PlaneMixture& mixture, PlaneReduction which)
      : mixture_(mixture),
        which_(which),
        cells_of_(mixture.planes.size()),
        moments_(mixture.planes.size(), Eigen::Matrix4d::Zero()) {
    for (std::uint32_t j = 0; j < mixture.cells().size(); ++j) {
      const MixtureCell& cell = mixture.cells()[j];
      for (const Membership& member : mixture.memberships(j)) {
        cells_of_[member.plane].push_back({j, member.share});
        if (member.share < 1e-3) continue;
        const double weight = member.share * cell.measurements / cell.variance_m2;
        moments_[member.plane] += MomentsOf(weight, cell.mean, cell.covariance);
      }
    }
  }

  // The planes that compete for cells with m, ascending.
  std::vector<std::size_t> Rivals(std::size_t m) const {
    std::vector<std::size_t> rivals;
    std::vector<bool> known(mixture_.planes.size(), false);
    known[m] = true;
    for (const SharedCell& shared : cells_of_[m]) {
      for (const Membership& other : mixture_.memberships(shared.cell)) {
        if (known[other.plane]) continue;
        known[other.plane] = true;
        rivals.push_back(other.plane);
      }
    }
    std::sort(rivals.begin(), rivals.end());
    return rivals;
  }

  Reduction Best(std::size_t m) const {
    const double saved = PlanePrice(mixture_);
    Reduction best;
    best.gone = m;
    const bool any = which_ == PlaneReduction::kAny;
    if (any) best.bic_change = -2.0 * Without(m) - saved;
    const double min_cosine = any ? kMergeCosine : kOnePlaneCosine;
    for (const std::size_t t : Rivals(m)) {
      const Plane& a = mixture_.planes[m].plane;
      const Plane& b = mixture_.planes[t].plane;
      const Eigen::Matrix4d both = moments_[m] + moments_[t];
      if (std::abs(a.normal.dot(b.normal)) < min_cosine || !(both(3, 3) > 0.0)) continue;
      const Plane joint = FitMoments(both).plane;
      const double share = moments_[t](3, 3) / both(3, 3);
      const LabColour colour =
          (1.0 - share) * mixture_.planes[m].colour + share * mixture_.planes[t].colour;
      const double change = -2.0 * Merged(m, t, joint, colour) - saved;
      if (change < best.bic_change) best = {m, t, joint, colour, change};
    }
    return best;
  }

 private:
  struct SharedCell {
    std::uint32_t cell = 0;
    double share = 0.0;
  };

  // Change of the log-likelihood.
  double Without(std::size_t m) const {
    double change = 0.0;
    for (const auto& [j, share] : cells_of_[m]) {
      change += Measurements(j) * std::log(std::max(1e-300, Rest(j, 1.0 - share)));
    }
    return change;
  }

  double Merged(std::size_t m, std::size_t t, const Plane& joint, const LabColour& colour) const {
    const MixturePlane &one = mixture_.planes[m], &other = mixture_.planes[t];
    MixturePlane plane;
    plane.plane = joint;
    plane.colour = colour;
    const double density =
        mixture_.PlaceDensity(one.chance + other.chance, UnionSize(one.voxels, other.voxels));
    double change = 0.0;
    const auto add = [&](std::uint32_t j, double shares) {
      const double now = density * mixture_.Odds(j, plane) / mixture_.odds_sum(j);
      change += Measurements(j) * std::log(std::max(1e-300, Rest(j, 1.0 - shares) + now));
    };
    auto a = cells_of_[m].begin(), b = cells_of_[t].begin();
    const auto a_end = cells_of_[m].end(), b_end = cells_of_[t].end();
    while (a != a_end || b != b_end) {
      const bool in_a = a != a_end && (b == b_end || a->cell <= b->cell);
      const bool in_b = b != b_end && (a == a_end || b->cell <= a->cell);
      const std::uint32_t j = in_a ? a->cell : b->cell;
      add(j, (in_a ? a->share : 0.0) + (in_b ? b->share : 0.0));
      if (in_a) ++a;
      if (in_b) ++b;
    }
    return change;
  }

  double Measurements(std::uint32_t j) const { return mixture_.cells()[j].measurements; }
  // Shares sum to 1 with clutter, which never has less than this.
  double Rest(std::uint32_t j, double share) const {
    return std::max(share, 1.0 / mixture_.odds_sum(j));
  }

  const PlaneMixture& mixture_;
  PlaneReduction which_;
  std::vector<std::vector<SharedCell>> cells_of_;  // that may be in it, ascending
  std::vector<Eigen::Matrix4d> moments_;           // of what is in it, weighted n/ρ²
};

// Those of the reductions, best first, that do not touch planes around an earlier one; `touched`
// gets all planes around them.
std::vector<Reduction> Independent(const LeaveOneOut& models,
                                   std::vector<Reduction> wanted,
                                   std::set<std::size_t>& touched) {
  std::stable_sort(wanted.begin(), wanted.end(), [](const Reduction& a, const Reduction& b) {
    return a.bic_change < b.bic_change;
  });
  std::vector<Reduction> taken;
  for (Reduction& one : wanted) {
    if (touched.contains(one.gone) || (one.into.has_value() && touched.contains(*one.into))) {
      continue;
    }
    const std::vector<std::size_t> around = models.Rivals(one.gone);
    touched.insert(around.begin(), around.end());
    touched.insert(one.gone);
    if (one.into.has_value()) {
      const std::vector<std::size_t> rivals = models.Rivals(*one.into);
      touched.insert(rivals.begin(), rivals.end());
    }
    taken.push_back(std::move(one));
  }
  return taken;
}

// Leaves planes that are gone without support, so that the others keep their places.
void Apply(const std::vector<Reduction>& reductions, PlaneMixture& mixture) {
  for (const Reduction& one : reductions) {
    const std::vector<Voxel> more = std::move(mixture.planes[one.gone].voxels);
    mixture.planes[one.gone].voxels.clear();
    if (!one.into.has_value()) continue;
    MixturePlane& into = mixture.planes[*one.into];
    into.plane = one.plane;
    into.colour = one.colour;
    into.voxels = Union(into.voxels, more);
  }
}

// Of the log-likelihood, where a column goes.
double LossWithout(const Eigen::MatrixXd::ConstColXpr& column,
                   const Eigen::VectorXd& sums,
                   const Eigen::VectorXd& none) {
  double loss = 0.0;
  for (Eigen::Index m = 0; m < column.size(); ++m) {
    if (column(m) == 0.0) continue;
    loss += std::log(sums(m) / std::max(none(m), sums(m) - column(m)));
  }
  return loss;
}

// Two directions as one between them, by what is more likely to have them.
struct DirectionMerge {
  std::size_t kept = 0, gone = 0;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  double bic_change = 0.0;
};

// What the merge does to the BIC; the mixture is as it was. `sums`: of the rows of `density`.
double MergeChange(const DirectionMerge& merge,
                   const Eigen::MatrixXd& density,
                   const Eigen::VectorXd& sums,
                   PlaneMixture& mixture) {
  const Eigen::Vector3d direction = mixture.directions[merge.kept];
  const double chance = mixture.chances[merge.kept];
  mixture.directions[merge.kept] = merge.direction;
  mixture.chances[merge.kept] += mixture.chances[merge.gone];
  double change = -kDirectionParameters * LogN(mixture);
  for (Eigen::Index m = 0; m < density.rows(); ++m) {
    const double all = sums(m);
    const double two = density(m, static_cast<Eigen::Index>(merge.kept)) +
                       density(m, static_cast<Eigen::Index>(merge.gone));
    const double one = mixture.DirectionDensity(static_cast<std::size_t>(m), merge.kept);
    if (two == 0.0 && one == 0.0) continue;
    change -= 2.0 * std::log((std::max(0.0, all - two) + one) / all);
  }
  mixture.directions[merge.kept] = direction;
  mixture.chances[merge.kept] = chance;
  return change;
}

// Of each plane and direction, at last none.
Eigen::MatrixXd DirectionDensities(const PlaneMixture& mixture) {
  Eigen::MatrixXd density(static_cast<Eigen::Index>(mixture.planes.size()),
                          static_cast<Eigen::Index>(mixture.chances.size()));
  for (Eigen::Index k = 0; k < density.cols(); ++k) {
    for (Eigen::Index m = 0; m < density.rows(); ++m) {
      density(m, k) =
          mixture.DirectionDensity(static_cast<std::size_t>(m), static_cast<std::size_t>(k));
    }
  }
  return density;
}

// Leaving one out and keeping the other where it is may be worse than both.
bool MergeDirections(PlaneMixture& mixture) {
  const Eigen::MatrixXd density = DirectionDensities(mixture);
  const Eigen::VectorXd sums = density.rowwise().sum();
  const double near = std::cos(kMergeSigmas * mixture.options().direction_sigma_rad);
  DirectionMerge best;
  for (std::size_t k = 0; k < mixture.directions.size(); ++k) {
    for (std::size_t l = k + 1; l < mixture.directions.size(); ++l) {
      const double cosine = mixture.directions[k].dot(mixture.directions[l]);
      if (std::abs(cosine) < near) continue;
      const Eigen::Vector3d other = (cosine < 0.0 ? -1.0 : 1.0) * mixture.directions[l];
      DirectionMerge merge{k, l, mixture.chances[k] * mixture.directions[k], 0.0};
      merge.direction = (merge.direction + mixture.chances[l] * other).normalized();
      merge.bic_change = MergeChange(merge, density, sums, mixture);
      if (merge.bic_change < best.bic_change) best = merge;
    }
  }
  if (!(best.bic_change < 0.0)) return false;
  mixture.directions[best.kept] = best.direction;
  mixture.chances[best.kept] += mixture.chances[best.gone];
  mixture.directions.erase(mixture.directions.begin() + static_cast<std::ptrdiff_t>(best.gone));
  mixture.chances.erase(mixture.chances.begin() + static_cast<std::ptrdiff_t>(best.gone));
  mixture.DirectionEStep();
  return true;
}

}  // namespace

double Bic(const PlaneMixture& mixture) {
  const auto planes = static_cast<double>(mixture.planes.size());
  const auto directions = static_cast<double>(mixture.directions.size());
  return -2.0 * mixture.LogLikelihood() + planes * PlanePrice(mixture) +
         kDirectionParameters * directions * LogN(mixture);
}

double PlanePrice(const PlaneMixture& mixture) {
  const double colour = mixture.options().colour ? kColourParameters : 0.0;
  return (kPlaneParameters + colour) * LogN(mixture);
}

bool DropDirections(PlaneMixture& mixture) {
  bool merged = false;
  while (MergeDirections(mixture)) merged = true;
  const auto M = static_cast<Eigen::Index>(mixture.planes.size());
  std::vector<std::size_t> left(mixture.chances.size());  // at last none, which stays
  std::iota(left.begin(), left.end(), 0U);
  const Eigen::MatrixXd density = DirectionDensities(mixture);
  const Eigen::VectorXd none = density.rightCols<1>();
  Eigen::VectorXd sums = density.rowwise().sum();
  double chances = 1.0;  // of those that are left
  while (left.size() > 1) {
    double best_change = 0.0;
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i + 1 < left.size(); ++i) {
      const double loss = LossWithout(density.col(static_cast<Eigen::Index>(left[i])), sums, none);
      // Those that stay share its chance.
      const double rise = std::log(chances / (chances - mixture.chances[left[i]]));
      const double change =
          2.0 * (loss - static_cast<double>(M) * rise) - kDirectionParameters * LogN(mixture);
      if (change >= best_change) continue;
      best_change = change;
      best = i;
    }
    if (!best.has_value()) break;
    chances -= mixture.chances[left[*best]];
    sums = (sums - density.col(static_cast<Eigen::Index>(left[*best]))).cwiseMax(none);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(*best));
  }
  if (left.size() == mixture.chances.size()) return merged;
  std::vector<Eigen::Vector3d> kept;
  std::vector<double> kept_chances;
  for (const std::size_t k : left) {
    if (k < mixture.directions.size()) kept.push_back(mixture.directions[k]);
    kept_chances.push_back(mixture.chances[k] / chances);
  }
  mixture.directions = std::move(kept);
  mixture.chances = std::move(kept_chances);
  mixture.DirectionEStep();
  return true;
}

absl::StatusOr<bool> DropPlanes(PlaneMixture& mixture, const Stop& stop, PlaneReduction which) {
  std::set<std::size_t> changed;
  for (std::size_t m = 0; m < mixture.planes.size(); ++m) changed.insert(m);
  std::map<std::size_t, Reduction> wanted;
  while (true) {
    const LeaveOneOut models(mixture, which);
    for (const std::size_t m : changed) {
      STRATA_RETURN_IF_ERROR(stop.status());
      wanted.erase(m);
      if (mixture.planes[m].voxels.empty()) continue;
      const Reduction best = models.Best(m);
      if (best.bic_change < 0.0) wanted[m] = best;
    }
    if (wanted.empty()) break;
    std::vector<Reduction> all;
    for (const auto& [m, reduction] : wanted) all.push_back(reduction);
    changed.clear();
    Apply(Independent(models, std::move(all), changed), mixture);
    mixture.Prepare();
  }
  const std::size_t dropped =
      std::erase_if(mixture.planes, [](const MixturePlane& plane) { return plane.voxels.empty(); });
  if (dropped > 0) mixture.Prepare();
  return dropped > 0;
}

}  // namespace strata
