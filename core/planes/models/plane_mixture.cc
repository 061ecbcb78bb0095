#include "core/planes/models/plane_mixture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
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
constexpr double kLeastShareLog = -20.8;
constexpr double kZeroLog = -60.0;  // beside 1
constexpr int kChanceSteps = 5;     // of chances alone, when planes came or left
constexpr int kTurns = 3;           // of planes and directions in an M-step

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

// std::exp() is slowest where there is nothing.
double ExpOrZero(double log) { return log < kZeroLog ? 0.0 : std::exp(log); }

using VoxelIds = HashMap<Voxel, std::uint32_t>;

double VoxelCount(const VoxelIds& ids) { return std::max(1.0, static_cast<double>(ids.size())); }

// Of the 27 voxels around one, itself included, those that are known.
std::vector<std::uint32_t> OccupiedAround(Voxel voxel, const VoxelIds& ids) {
  std::vector<std::uint32_t> occupied;
  for (const Voxel around : VoxelsAround(voxel)) {
    const auto found = ids.find(around);
    if (found != ids.end()) occupied.push_back(found->second);
  }
  return occupied;
}

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
    : cells_(std::move(cells)), options_(options), begins_(cells_.size() + 1, 0) {
  std::vector<Voxel> voxels;
  for (const MixtureCell& cell : cells_) {
    const Voxel voxel = VoxelOf(cell.mean);
    const auto [id, is_new] =
        voxel_ids_.try_emplace(voxel, static_cast<std::uint32_t>(voxels.size()));
    if (is_new) voxels.push_back(voxel);
    voxel_of_.push_back(id->second);
    measurements_ += cell.measurements;
    peak_logs_.push_back(PeakLog(cell));
  }
  odds_sums_.assign(cells_.size(), 1.0);
  for (const Voxel voxel : voxels) neighbours_.push_back(OccupiedAround(voxel, voxel_ids_));
}

double PlaneMixture::MeanChance(std::size_t voxels) const {
  return (1.0 - kClutterShare) * static_cast<double>(voxels) / VoxelCount(voxel_ids_);
}

std::optional<std::uint32_t> PlaneMixture::PlaneOf(std::size_t j) const {
  double sum = 0.0, most = 0.0;
  std::uint32_t plane = 0;
  for (const Membership& member : memberships(j)) {
    sum += member.share;
    if (member.share <= most) continue;
    most = member.share;
    plane = member.plane;
  }
  return sum > 0.5 ? std::optional(plane) : std::nullopt;
}

double PlaneMixture::PlaceDensity(double chance, std::size_t voxels) const {
  return chance * VoxelCount(voxel_ids_) / static_cast<double>(std::max<std::size_t>(1, voxels));
}

double PlaneMixture::Misfit(const MixtureCell& cell, const MixturePlane& plane) const {
  const Eigen::Vector3d& n = plane.plane.normal;
  const double off = n.dot(cell.mean) - plane.plane.distance;
  const double place = (off * off + n.dot(cell.covariance * n)) / (2.0 * cell.variance_m2);
  return options_.colour ? place - ColourLog(SquaredColourDistance(cell, plane)) : place;
}

double PlaneMixture::CellLog(const MixtureCell& cell, const MixturePlane& plane) const {
  return std::log(PlaceDensity(plane)) + PeakLog(cell) - Misfit(cell, plane);
}

double PlaneMixture::Odds(std::size_t j, const MixturePlane& plane) const {
  return ExpOrZero(peak_logs_[j] - Misfit(cells_[j], plane) - ClutterLog());
}

double PlaneMixture::ClutterLog() const {
  static const double share = std::log(kClutterShare);
  const double place = share - std::log(2.0 * options_.clutter_half_m);
  return options_.colour ? place + AnyColourLog() : place;
}

double PlaneMixture::DirectionDensity(std::size_t m, std::size_t k) const {
  if (k == directions.size()) return chances[k] / (2.0 * M_PI);  // even on the half sphere
  const double cosine = planes[m].plane.normal.dot(directions[k]);
  const double sigma = options_.direction_sigma_rad;
  const double precision = planes[m].weight / (sigma * sigma);
  const double peak = chances[k] * precision / (2.0 * M_PI);
  return peak * ExpOrZero(-0.5 * precision * (1.0 - cosine * cosine));
}

double PlaneMixture::DirectionLog(std::size_t m, std::size_t k) const {
  if (k == directions.size()) return std::log(DirectionDensity(m, k));
  const double cosine = planes[m].plane.normal.dot(directions[k]);
  const double precision = planes[m].weight / std::pow(options_.direction_sigma_rad, 2);
  return std::log(chances[k] * precision / (2.0 * M_PI)) -
         0.5 * precision * (1.0 - cosine * cosine);
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

std::vector<std::vector<std::uint32_t>> PlaneMixture::PlanesByVoxel() const {
  std::vector<std::vector<std::uint32_t>> near(neighbours_.size());
  const auto add = [&near](std::span<const std::uint32_t> around, std::uint32_t m) {
    for (const std::uint32_t id : around) {
      if (near[id].empty() || near[id].back() != m) near[id].push_back(m);
    }
  };
  for (std::uint32_t m = 0; m < planes.size(); ++m) {
    for (const Voxel voxel : planes[m].voxels) {
      const auto found = voxel_ids_.find(voxel);
      if (found != voxel_ids_.end()) {
        add(neighbours_[found->second], m);
      } else {
        add(OccupiedAround(voxel, voxel_ids_), m);
      }
    }
  }
  return near;
}

std::vector<double> PlaneMixture::FindMembers() {
  const std::vector<std::vector<std::uint32_t>> near = PlanesByVoxel();
  const double clutter = ClutterLog();
  std::vector<double> most_logs;  // of each plane's density, were it the only one
  for (const MixturePlane& plane : planes) {
    most_logs.push_back(std::log(PlaceDensity(1.0, plane.voxels.size())));
  }
  members_.clear();
  std::vector<double> odds;
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    begins_[j] = members_.size();
    const MixtureCell& cell = cells_[j];
    for (const std::uint32_t m : near[voxel_of_[j]]) {
      const double log = peak_logs_[j] - Misfit(cell, planes[m]) - clutter;
      if (log + most_logs[m] < kLeastShareLog) continue;
      members_.push_back({m, 0.0});
      odds.push_back(std::exp(log));
    }
  }
  begins_.back() = members_.size();
  return odds;
}

void PlaneMixture::DropLeast() {
  std::size_t kept = 0;
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    const std::size_t begin = begins_[j], end = begins_[j + 1];
    begins_[j] = kept;
    for (std::size_t i = begin; i < end; ++i) {
      if (members_[i].share >= kLeastShare) members_[kept++] = members_[i];
    }
  }
  begins_.back() = kept;
  members_.resize(kept);
}

void PlaneMixture::WeighNormals() {
  std::vector<double> area(planes.size(), 0.0);
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    for (const Membership& member : memberships(j)) {
      area[member.plane] += member.share * cells_[j].area_m2;
    }
  }
  for (std::size_t m = 0; m < planes.size(); ++m) {
    planes[m].weight =
        std::clamp(area[m] / options_.independent_area_m2, 1.0, options_.max_measurements);
  }
}

void PlaneMixture::Prepare() {
  const std::vector<double> odds = FindMembers();
  double voxels = 0.0;
  for (const MixturePlane& plane : planes) voxels += static_cast<double>(plane.voxels.size());
  for (MixturePlane& plane : planes) {
    plane.chance = (1.0 - kClutterShare) * static_cast<double>(plane.voxels.size()) / voxels;
  }
  ShareOut(odds);
  for (int i = 0; i < kChanceSteps; ++i) {
    UpdateChances();
    ShareOut(odds);
  }
  DropLeast();
  WeighNormals();
  EStep();
}

void PlaneMixture::UpdateChances() {
  constexpr double kLeast = 1e-6;
  double all = 0.0;
  for (const double measurements : plane_measurements_) all += measurements + kLeast;
  for (std::size_t m = 0; m < planes.size(); ++m) {
    planes[m].chance = (1.0 - kClutterShare) * (plane_measurements_[m] + kLeast) / all;
  }
}

void PlaneMixture::ShareOut(std::span<const double> odds) {
  const double clutter = ClutterLog();
  std::vector<double> densities;
  densities.reserve(planes.size());
  for (const MixturePlane& plane : planes) densities.push_back(PlaceDensity(plane));
  plane_measurements_.assign(planes.size(), 0.0);
  data_log_ = measurements_ * clutter;
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    double sum = 1.0;
    for (std::size_t i = begins_[j]; i < begins_[j + 1]; ++i) {
      members_[i].share = densities[members_[i].plane] * odds[i];
      sum += members_[i].share;
    }
    const double measurements = cells_[j].measurements;
    for (std::size_t i = begins_[j]; i < begins_[j + 1]; ++i) {
      members_[i].share /= sum;
      plane_measurements_[members_[i].plane] += measurements * members_[i].share;
    }
    odds_sums_[j] = sum;
    data_log_ += measurements * std::log(sum);
  }
}

void PlaneMixture::EStep() {
  const double clutter = ClutterLog();
  std::vector<double> odds(members_.size());
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    for (std::size_t i = begins_[j]; i < begins_[j + 1]; ++i) {
      const double misfit = Misfit(cells_[j], planes[members_[i].plane]);
      odds[i] = ExpOrZero(peak_logs_[j] - misfit - clutter);
    }
  }
  ShareOut(odds);
  DirectionEStep();
}

void PlaneMixture::DirectionEStep() {
  prior_log_ = 0.0;
  if (!options_.directions) return;
  for (const double chance : chances) prior_log_ += std::log(chance);
  beta_.resize(static_cast<Eigen::Index>(planes.size()),
               static_cast<Eigen::Index>(directions.size()) + 1);
  for (Eigen::Index m = 0; m < beta_.rows(); ++m) {
    for (Eigen::Index k = 0; k < beta_.cols(); ++k) {
      beta_(m, k) = DirectionDensity(static_cast<std::size_t>(m), static_cast<std::size_t>(k));
    }
    const double sum = beta_.row(m).sum();
    beta_.row(m) /= sum;
    prior_log_ += std::log(sum);
  }
}

std::vector<PlaneMixture::Scatter> PlaneMixture::Scatters() const {
  std::vector<Scatter> scatters(planes.size());
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    const MixtureCell& cell = cells_[j];
    for (const Membership& member : memberships(j)) {
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

void PlaneMixture::UpdateDirectionChances() {
  const Eigen::VectorXd sums = beta_.colwise().sum();
  const double all = sums.sum() + static_cast<double>(chances.size());
  for (std::size_t k = 0; k < chances.size(); ++k) {
    chances[k] = (sums(static_cast<Eigen::Index>(k)) + 1.0) / all;
  }
}

void PlaneMixture::FitPlanes(const std::vector<Scatter>& scatters,
                             const std::vector<MixturePlane>& before) {
  const double prior = 1.0 / std::pow(options_.direction_sigma_rad, 2);
  for (std::size_t m = 0; m < planes.size(); ++m) {
    const Scatter& scatter = scatters[m];
    if (!(scatter.weight > 0.0)) continue;
    const Eigen::Vector3d mean = scatter.first / scatter.weight;
    Eigen::Matrix3d squares = scatter.second - scatter.weight * mean * mean.transpose();
    for (std::size_t k = 0; options_.directions && k < directions.size(); ++k) {
      const double share = beta_(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(k));
      if (share == 0.0) continue;
      squares -= prior * planes[m].weight * share * directions[k] * directions[k].transpose();
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(squares);
    Plane& plane = planes[m].plane;
    const Eigen::Vector3d normal = solver.eigenvectors().col(0);
    plane.normal = normal.dot(before[m].plane.normal) < 0.0 ? Eigen::Vector3d(-normal) : normal;
    const Plane& old = before[m].plane;
    plane.distance = plane.normal.dot(mean + old.distance * old.normal);
  }
}

void PlaneMixture::FitDirections() {
  for (std::size_t k = 0; k < directions.size(); ++k) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (std::size_t m = 0; m < planes.size(); ++m) {
      const double share = beta_(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(k));
      if (share == 0.0) continue;
      const Eigen::Vector3d& n = planes[m].plane.normal;
      sum += planes[m].weight * share * n * n.transpose();
    }
    if (!(sum.trace() > 1e-9)) continue;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(sum);
    directions[k] = solver.eigenvectors().col(2);
  }
}

void PlaneMixture::MStep() {
  if (options_.directions) UpdateDirectionChances();
  UpdateChances();
  const std::vector<Scatter> scatters = Scatters();
  for (std::size_t m = 0; m < planes.size(); ++m) {
    if (!(scatters[m].colour_weight > 0.0)) continue;
    planes[m].colour = scatters[m].colour / scatters[m].colour_weight;
  }
  const std::vector<MixturePlane> before = planes;
  for (int turn = 0; turn < (options_.directions ? kTurns : 1); ++turn) {
    FitPlanes(scatters, before);
    if (options_.directions) FitDirections();
  }
}

double PlaneMixture::ExpectedLogLikelihood() const {
  double sum = 0.0;
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    for (const Membership& member : memberships(j)) {
      sum += cells_[j].measurements * member.share * CellLog(cells_[j], planes[member.plane]);
    }
  }
  if (!options_.directions) return sum;
  for (const double chance : chances) sum += std::log(chance);
  for (Eigen::Index m = 0; m < beta_.rows(); ++m) {
    for (Eigen::Index k = 0; k < beta_.cols(); ++k) {
      if (beta_(m, k) == 0.0) continue;
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
