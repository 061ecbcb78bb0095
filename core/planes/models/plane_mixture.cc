#include "core/planes/models/plane_mixture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/geometry/eigen_solvers.h"

namespace strata {
namespace {

constexpr int kVoxelBits = 21;
constexpr std::int64_t kVoxelOffset = std::int64_t{1} << (kVoxelBits - 1);
constexpr std::uint64_t kVoxelMask = (std::uint64_t{1} << kVoxelBits) - 1;
constexpr double kClutterShare = 0.1;  // of the measurements
constexpr double kSettledGain = 1e-6;  // of the objective, a measurement
constexpr std::size_t kMostDirections = 64;
constexpr double kLeastShare = 1e-9;  // of a cell, or it cannot be in the plane
constexpr int kChanceSteps = 5;       // of chances alone, when planes came or left
constexpr int kTurns = 3;             // of planes and directions in an M-step

Voxel VoxelKey(std::int64_t x, std::int64_t y, std::int64_t z) {
  const auto bits = [](std::int64_t v) {
    return static_cast<std::uint64_t>(v + kVoxelOffset) & kVoxelMask;
  };
  return bits(x) << (2 * kVoxelBits) | bits(y) << kVoxelBits | bits(z);
}

std::int64_t Axis(Voxel voxel, int shift) {
  return static_cast<std::int64_t>(voxel >> shift & kVoxelMask) - kVoxelOffset;
}

double PeakLog(const MixtureCell& cell) { return -0.5 * std::log(2.0 * M_PI * cell.variance_m2); }

// Mean of 5.23's square over the points of a cell.
double SquaredColourDistance(const MixtureCell& cell, const MixturePlane& plane) {
  return (cell.colour - plane.colour).squaredNorm() + cell.colour_variance;
}

}  // namespace

Voxel VoxelOf(const Eigen::Vector3d& point) {
  const auto at = [](double v) { return static_cast<std::int64_t>(std::floor(v / kVoxelM)); };
  return VoxelKey(at(point.x()), at(point.y()), at(point.z()));
}

std::vector<Voxel> VoxelsAround(Voxel voxel) {
  const std::int64_t x = Axis(voxel, 2 * kVoxelBits), y = Axis(voxel, kVoxelBits),
                     z = Axis(voxel, 0);
  std::vector<Voxel> around;
  around.reserve(27);
  for (int k = 0; k < 27; ++k) {
    around.push_back(VoxelKey(x + k / 9 - 1, y + k / 3 % 3 - 1, z + k % 3 - 1));
  }
  return around;
}

Eigen::AlignedBox3d BoxOf(Voxel voxel) {
  const auto at = [voxel](int shift) { return kVoxelM * static_cast<double>(Axis(voxel, shift)); };
  const Eigen::Vector3d corner(at(2 * kVoxelBits), at(kVoxelBits), at(0));
  return {corner, corner.array() + kVoxelM};
}

PlaneMixture::PlaneMixture(std::vector<MixtureCell> cells, const MixtureOptions& options)
    : cells_(std::move(cells)), options_(options) {
  HashSet<Voxel> voxels;
  peak_logs_.reserve(cells_.size());
  for (const MixtureCell& cell : cells_) {
    voxels.insert(VoxelOf(cell.mean));
    measurements_ += cell.measurements;
    peak_logs_.push_back(PeakLog(cell));
  }
  voxel_count_ = std::max<std::size_t>(1, voxels.size());
}

double PlaneMixture::MeanChance(std::size_t voxels) const {
  return (1.0 - kClutterShare) * static_cast<double>(voxels) / static_cast<double>(voxel_count_);
}

std::optional<std::uint32_t> PlaneMixture::PlaneOf(std::size_t j) const {
  double sum = 0.0, most = 0.0;
  std::uint32_t plane = 0;
  for (const Membership& member : members_[j]) {
    sum += member.share;
    if (member.share <= most) continue;
    most = member.share;
    plane = member.plane;
  }
  return sum > 0.5 ? std::optional(plane) : std::nullopt;
}

double PlaneMixture::DensityLog(const MixturePlane& plane) const {
  const double voxels = static_cast<double>(std::max<std::size_t>(1, plane.voxels.size()));
  return std::log(plane.chance * static_cast<double>(voxel_count_) / voxels);
}

double PlaneMixture::Misfit(const MixtureCell& cell, const MixturePlane& plane) const {
  const Eigen::Vector3d& n = plane.plane.normal;
  const double off = n.dot(cell.mean) - plane.plane.distance;
  const double place = (off * off + n.dot(cell.covariance * n)) / (2.0 * cell.variance_m2);
  return options_.colour ? place - ColourLog(SquaredColourDistance(cell, plane)) : place;
}

double PlaneMixture::CellLog(const MixtureCell& cell, const MixturePlane& plane) const {
  return DensityLog(plane) + PeakLog(cell) - Misfit(cell, plane);
}

double PlaneMixture::ClutterLog() const {
  const double place = std::log(kClutterShare) - std::log(2.0 * options_.clutter_half_m);
  return options_.colour ? place + AnyColourLog() : place;
}

double PlaneMixture::DirectionLog(std::size_t m, std::size_t k) const {
  const double chance = std::log(chances[k]);
  if (k == directions.size()) return chance - std::log(2.0 * M_PI);  // even on the half sphere
  const double cosine = planes[m].plane.normal.dot(directions[k]);
  const double precision = planes[m].weight / std::pow(options_.direction_sigma_rad, 2);
  return chance + std::log(precision / (2.0 * M_PI)) - 0.5 * precision * (1.0 - cosine * cosine);
}

void PlaneMixture::AddDirection(const Eigen::Vector3d& direction) {
  if (!options_.directions || directions.size() >= kMostDirections) return;
  const double near = std::cos(options_.direction_sigma_rad);
  const bool known = std::any_of(directions.begin(), directions.end(), [&](const auto& other) {
    return std::abs(other.dot(direction)) > near;
  });
  if (known) return;
  const double chance = 1.0 / static_cast<double>(planes.size() + directions.size() + 2);
  for (double& other : chances) other *= 1.0 - chance;
  directions.push_back(direction);
  chances.insert(chances.end() - 1, chance);
}

void PlaneMixture::Prepare() {
  HashMap<Voxel, std::vector<std::uint32_t>> near;
  for (std::uint32_t m = 0; m < planes.size(); ++m) {
    for (const Voxel voxel : planes[m].voxels) {
      for (const Voxel around : VoxelsAround(voxel)) {
        std::vector<std::uint32_t>& list = near[around];
        if (list.empty() || list.back() != m) list.push_back(m);
      }
    }
  }
  members_.assign(cells_.size(), {});
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    const auto found = near.find(VoxelOf(cells_[j].mean));
    if (found == near.end()) continue;
    for (const std::uint32_t m : found->second) members_[j].push_back({m, 0.0});
  }
  double voxels = 0.0;
  for (const MixturePlane& plane : planes) voxels += static_cast<double>(plane.voxels.size());
  for (MixturePlane& plane : planes) {
    plane.chance = (1.0 - kClutterShare) * static_cast<double>(plane.voxels.size()) / voxels;
  }
  EStep();
  for (int i = 0; i < kChanceSteps; ++i) {
    UpdateChances();
    EStep();
  }
  for (std::vector<Membership>& members : members_) {
    std::erase_if(members, [](const Membership& member) { return member.share < kLeastShare; });
  }
  std::vector<double> area(planes.size(), 0.0);
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    for (const Membership& member : members_[j]) {
      area[member.plane] += member.share * cells_[j].area_m2;
    }
  }
  for (std::size_t m = 0; m < planes.size(); ++m) {
    planes[m].weight =
        std::clamp(area[m] / options_.independent_area_m2, 1.0, options_.max_measurements);
  }
  EStep();
}

void PlaneMixture::UpdateChances() {
  std::vector<double> sums(planes.size(), 1e-6);
  double all = 1e-6 * static_cast<double>(planes.size());
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    for (const Membership& member : members_[j]) {
      const double measurements = member.share * cells_[j].measurements;
      sums[member.plane] += measurements;
      all += measurements;
    }
  }
  for (std::size_t m = 0; m < planes.size(); ++m) {
    planes[m].chance = (1.0 - kClutterShare) * sums[m] / all;
  }
}

void PlaneMixture::EStep() {
  data_log_ = 0.0;
  const double clutter = ClutterLog();
  std::vector<double> densities;
  densities.reserve(planes.size());
  for (const MixturePlane& plane : planes) densities.push_back(DensityLog(plane));
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    double most = clutter;
    for (Membership& member : members_[j]) {
      member.share =
          densities[member.plane] + peak_logs_[j] - Misfit(cells_[j], planes[member.plane]);
      most = std::max(most, member.share);
    }
    double sum = std::exp(clutter - most);
    for (Membership& member : members_[j]) {
      member.share = std::exp(member.share - most);
      sum += member.share;
    }
    for (Membership& member : members_[j]) member.share /= sum;
    data_log_ += cells_[j].measurements * (most + std::log(sum));
  }
  prior_log_ = 0.0;
  if (!options_.directions) return;
  for (const double chance : chances) prior_log_ += std::log(chance);
  const auto K = static_cast<Eigen::Index>(directions.size());
  beta_.resize(static_cast<Eigen::Index>(planes.size()), K + 1);
  for (Eigen::Index m = 0; m < beta_.rows(); ++m) {
    for (Eigen::Index k = 0; k <= K; ++k) {
      beta_(m, k) = DirectionLog(static_cast<std::size_t>(m), static_cast<std::size_t>(k));
    }
    const double most = beta_.row(m).maxCoeff();
    beta_.row(m) = (beta_.row(m).array() - most).exp();
    const double sum = beta_.row(m).sum();
    beta_.row(m) /= sum;
    prior_log_ += most + std::log(sum);
  }
}

std::vector<PlaneMixture::Scatter> PlaneMixture::Scatters() const {
  std::vector<Scatter> scatters(planes.size());
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    const MixtureCell& cell = cells_[j];
    for (const Membership& member : members_[j]) {
      if (member.share < 1e-12) continue;
      const double w = member.share * cell.measurements / cell.variance_m2;
      Scatter& scatter = scatters[member.plane];
      // About a point of the plane: far from the frame's origin the sums would lose their digits.
      const Plane& plane = planes[member.plane].plane;
      const Eigen::Vector3d x = cell.mean - plane.distance * plane.normal;
      scatter.weight += w;
      scatter.first += w * x;
      scatter.second += w * (cell.covariance + x * x.transpose());
      if (!options_.colour) continue;
      const double u = member.share * cell.measurements *
                       ColourWeight(SquaredColourDistance(cell, planes[member.plane]));
      scatter.colour_weight += u;
      scatter.colour += u * cell.colour;
    }
  }
  return scatters;
}

void PlaneMixture::MStep() {
  if (options_.directions) {
    const Eigen::VectorXd sums = beta_.colwise().sum();
    const double all = sums.sum() + static_cast<double>(chances.size());
    for (std::size_t k = 0; k < chances.size(); ++k) {
      chances[k] = (sums(static_cast<Eigen::Index>(k)) + 1.0) / all;
    }
  }
  UpdateChances();
  const std::vector<Scatter> scatters = Scatters();
  for (std::size_t m = 0; m < planes.size(); ++m) {
    if (!(scatters[m].colour_weight > 0.0)) continue;
    planes[m].colour = scatters[m].colour / scatters[m].colour_weight;
  }
  const std::vector<MixturePlane> before = planes;
  const double prior = 1.0 / std::pow(options_.direction_sigma_rad, 2);
  for (int turn = 0; turn < (options_.directions ? kTurns : 1); ++turn) {
    for (std::size_t m = 0; m < planes.size(); ++m) {
      const Scatter& scatter = scatters[m];
      if (!(scatter.weight > 0.0)) continue;
      const Eigen::Vector3d mean = scatter.first / scatter.weight;
      Eigen::Matrix3d squares = scatter.second - scatter.weight * mean * mean.transpose();
      for (std::size_t k = 0; options_.directions && k < directions.size(); ++k) {
        const double share = beta_(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(k));
        squares -= prior * planes[m].weight * share * directions[k] * directions[k].transpose();
      }
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares);
      Plane& plane = planes[m].plane;
      const Eigen::Vector3d normal = solver.eigenvectors().col(0);
      plane.normal = normal.dot(before[m].plane.normal) < 0.0 ? Eigen::Vector3d(-normal) : normal;
      const Plane& old = before[m].plane;
      plane.distance = plane.normal.dot(mean + old.distance * old.normal);
    }
    for (std::size_t k = 0; options_.directions && k < directions.size(); ++k) {
      Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
      for (std::size_t m = 0; m < planes.size(); ++m) {
        const Eigen::Vector3d& n = planes[m].plane.normal;
        const double share = beta_(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(k));
        sum += planes[m].weight * share * n * n.transpose();
      }
      if (!(sum.trace() > 1e-9)) continue;
      directions[k] = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvectors().col(2);
    }
  }
}

double PlaneMixture::ExpectedLogLikelihood() const {
  double sum = 0.0;
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    for (const Membership& member : members_[j]) {
      sum += cells_[j].measurements * member.share * CellLog(cells_[j], planes[member.plane]);
    }
  }
  if (!options_.directions) return sum;
  for (const double chance : chances) sum += std::log(chance);
  for (Eigen::Index m = 0; m < beta_.rows(); ++m) {
    for (Eigen::Index k = 0; k < beta_.cols(); ++k) {
      sum += beta_(m, k) * DirectionLog(static_cast<std::size_t>(m), static_cast<std::size_t>(k));
    }
  }
  return sum;
}

absl::Status PlaneMixture::Run(int max_steps, const Stop& stop) {
  EStep();
  for (int step = 0; step < max_steps; ++step) {
    STRATA_RETURN_IF_ERROR(stop.status());
    const double before = LogLikelihood();
    MStep();
    EStep();
    if (LogLikelihood() - before < kSettledGain * measurements_) break;
  }
  return absl::OkStatus();
}

void PlaneMixture::RefreshSupport() {
  for (MixturePlane& plane : planes) plane.voxels.clear();
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    const std::optional<std::uint32_t> plane = PlaneOf(j);
    if (plane.has_value()) planes[*plane].voxels.push_back(VoxelOf(cells_[j].mean));
  }
  for (MixturePlane& plane : planes) {
    std::sort(plane.voxels.begin(), plane.voxels.end());
    plane.voxels.erase(std::unique(plane.voxels.begin(), plane.voxels.end()), plane.voxels.end());
  }
}

}  // namespace strata
