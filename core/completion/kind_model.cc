#include "core/completion/kind_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "core/registration/registration_result.h"

namespace strata {
namespace {

constexpr int kTurns = 16;
constexpr std::size_t kStartSamples = 100;
constexpr std::size_t kMostMeasured = 8;
constexpr std::size_t kMostStarts = 3;
constexpr double kLeastShare = 0.65;  // of the points within voxels, and on the kind at last
constexpr int kMostVoxelsAlong = 48;
constexpr double kReachSpacings = 1.5;
constexpr double kToleranceSpacings = 0.4;  // where points are sparse, their normals are less sure
constexpr std::size_t kNormalNeighbours = 9;
// Registration: first few points from every start, then more from the best.
constexpr std::size_t kCoarseSamples = 120;
constexpr int kCoarseIterations = 10;
constexpr std::size_t kFineSamples = 500;
constexpr int kFineIterations = 15;
constexpr double kKeepShare = 0.8;
constexpr double kShrink = 0.75;  // of the reach, an iteration
constexpr std::size_t kFewestPairs = 12;
constexpr double kStill = 1e-5;
constexpr double kLeastUprightness = 0.94;  // cosine of 20°

// Every so manyth of the points, `samples` at most.
std::vector<Eigen::Vector3f> SamplesOf(const ThingPoints& thing, std::size_t samples) {
  const std::vector<Eigen::Vector3f>& points = thing.points();
  if (points.size() <= samples) return points;
  std::vector<Eigen::Vector3f> some;
  for (std::size_t i = 0; i < samples; ++i) some.push_back(points[i * points.size() / samples]);
  return some;
}

// Where the box [low, high] of a thing is put along an axis of the kind's box.
std::vector<float> ShiftsAlong(float low, float high, float kind_low, float kind_high, bool sides) {
  const float middle = 0.5F * (kind_low + kind_high - low - high);
  const float slack = 0.5F * (kind_high - kind_low - high + low);
  if (!sides || slack < 0.1F) return {middle};
  return {middle - slack, middle, middle + slack};
}

struct Pair {
  Eigen::Vector3d p;  // of the thing
  Eigen::Vector3d n;  // of the kind
  double r = 0.0;     // distance from its plane
};

NormalStep StepOf(std::vector<Pair>& pairs, const Pose& T, double radius_m, double min_ratio) {
  const auto kept = static_cast<std::ptrdiff_t>(kKeepShare * static_cast<double>(pairs.size()));
  std::nth_element(
      pairs.begin(), pairs.begin() + kept, pairs.end(), [](const Pair& a, const Pair& b) {
        return std::abs(a.r) < std::abs(b.r);
      });
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  for (std::ptrdiff_t i = 0; i < kept; ++i) {
    const Pair& pair = pairs[static_cast<std::size_t>(i)];
    const Eigen::Vector3d n = T.linear().transpose() * pair.n;
    Vector6d J;
    J << pair.p.cross(n), n;
    H += J * J.transpose();
    b -= J * pair.r;
  }
  return SolveNormalEquations(H, b, radius_m, min_ratio);
}

}  // namespace

KindModel::KindModel(std::vector<Eigen::Vector3f> points, double tolerance_m)
    : thing_(std::move(points)),
      tolerance_m_(std::max(tolerance_m, kToleranceSpacings * thing_.spacing_m())),
      reach_m_(std::max(kReachSpacings * thing_.spacing_m(), tolerance_m_)) {
  FillNormals();
  FillVoxels();
}

void KindModel::FillNormals() {
  for (const Eigen::Vector3f& p : thing_.points()) {
    const std::vector<std::uint32_t> around = thing_.NeighboursOf(p, kNormalNeighbours);
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();
    for (const std::uint32_t i : around) mean += thing_.points()[i];
    mean /= static_cast<float>(around.size());
    Eigen::Matrix3f scatter = Eigen::Matrix3f::Zero();
    for (const std::uint32_t i : around) {
      const Eigen::Vector3f d = thing_.points()[i] - mean;
      scatter += d * d.transpose();
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
    solver.computeDirect(scatter);
    const Eigen::Vector3f normal = solver.eigenvectors().col(0);
    normals_.push_back(normal.allFinite() ? normal : Eigen::Vector3f::UnitZ());
  }
}

void KindModel::FillVoxels() {
  const Eigen::Array3d sizes = thing_.bounds().sizes().cast<double>().array();
  voxel_m_ = std::max(reach_m_, sizes.maxCoeff() / kMostVoxelsAlong);
  counts_ = (sizes / voxel_m_).floor().cast<int>() + 3;
  voxels_.assign(static_cast<std::size_t>(counts_.cast<std::int64_t>().prod()), false);
  for (const Eigen::Vector3f& p : thing_.points()) {
    const Eigen::Array3i at =
        ((p - thing_.bounds().min()).array().cast<double>() / voxel_m_).floor().cast<int>();
    for (int i = 0; i < 27; ++i) {
      const Eigen::Array3i k = at + Eigen::Array3i(i % 3, i / 3 % 3, i / 9);
      voxels_[static_cast<std::size_t>((k.z() * counts_.y() + k.y()) * counts_.x() + k.x())] = true;
    }
  }
}

bool KindModel::HasVoxelAt(const Eigen::Vector3f& p) const {
  const Eigen::Array3d scaled = (p - thing_.bounds().min()).array().cast<double>() / voxel_m_ + 1.0;
  if ((scaled < 0.0).any() || (scaled >= counts_.cast<double>()).any()) return false;
  const Eigen::Array3i k = scaled.floor().cast<int>();
  return voxels_[static_cast<std::size_t>((k.z() * counts_.y() + k.y()) * counts_.x() + k.x())];
}

void KindModel::AddStarts(const ThingPoints& thing,
                          const std::vector<Eigen::Vector3f>& samples,
                          double angle,
                          bool sides,
                          std::vector<Start>& starts) const {
  const Eigen::Matrix3d R = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  std::vector<Eigen::Vector3f> turned;
  for (const Eigen::Vector3f& p : samples) turned.push_back(R.cast<float>() * p);
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : thing.points()) box.extend(R.cast<float>() * p);
  const Eigen::AlignedBox3f& own = thing_.bounds();
  const auto shifts = [&](int k) {
    return ShiftsAlong(box.min()[k], box.max()[k], own.min()[k], own.max()[k], sides);
  };
  std::vector<float> rises = {own.min().z() - box.min().z()};
  if (sides) rises.push_back(own.max().z() - box.max().z());
  for (const float x : shifts(0)) {
    for (const float y : shifts(1)) {
      for (const float z : rises) {
        const Eigen::Vector3f shift(x, y, z);
        const auto within = std::count_if(
            turned.begin(), turned.end(), [&](const auto& p) { return HasVoxelAt(p + shift); });
        Start start;
        start.share = static_cast<double>(within) / static_cast<double>(turned.size());
        if (start.share < kLeastShare) continue;
        start.T_kind_thing.linear() = R;
        start.T_kind_thing.translation() = shift.cast<double>();
        starts.push_back(start);
      }
    }
  }
}

// Mean distance of the points from the kind's, no farther than where its voxels end.
double KindModel::DistanceFrom(const Pose& T_kind_thing,
                               const std::vector<Eigen::Vector3f>& samples) const {
  double sum = 0.0;
  for (const Eigen::Vector3f& p : samples) {
    const Eigen::Vector3f moved = (T_kind_thing * p.cast<double>()).cast<float>();
    const auto nearest = thing_.NearestTo(moved, voxel_m_);
    sum += nearest.has_value() ? (moved - thing_.points()[*nearest]).norm() : voxel_m_;
  }
  return sum / static_cast<double>(samples.size());
}

std::vector<KindModel::Start> KindModel::StartsOf(const ThingPoints& thing,
                                                  KindStarts starts) const {
  const std::vector<Eigen::Vector3f> samples = SamplesOf(thing, kStartSamples);
  std::vector<Start> best;
  for (int turn = 0; turn < kTurns; ++turn) {
    const double angle = 2.0 * std::numbers::pi * turn / kTurns;
    AddStarts(thing, samples, angle, starts == KindStarts::kSideOnSide, best);
  }
  std::stable_sort(
      best.begin(), best.end(), [](const Start& a, const Start& b) { return a.share > b.share; });
  if (best.size() > kMostMeasured) best.resize(kMostMeasured);
  // Voxels are coarse, and many starts may have all points within them.
  for (Start& start : best) start.distance_m = DistanceFrom(start.T_kind_thing, samples);
  std::stable_sort(best.begin(), best.end(), [](const Start& a, const Start& b) {
    return a.distance_m < b.distance_m;
  });
  if (best.size() > kMostStarts) best.resize(kMostStarts);
  return best;
}

Pose KindModel::Refine(const ThingPoints& thing,
                       const Pose& T_guess,
                       std::size_t samples,
                       int iterations,
                       double first_reach_m) const {
  constexpr double kMinEigenvalueRatio = 1e-3;
  const double radius_m = 0.5 * thing.bounds().sizes().cast<double>().norm();
  const std::vector<Eigen::Vector3f> points = SamplesOf(thing, samples);
  Pose T = T_guess;
  double reach_m = first_reach_m;
  std::vector<Pair> pairs;
  for (int i = 0; i < iterations; ++i, reach_m = std::max(reach_m_, kShrink * reach_m)) {
    pairs.clear();
    for (const Eigen::Vector3f& p : points) {
      const Eigen::Vector3d moved = T * p.cast<double>();
      const auto nearest = thing_.NearestTo(moved.cast<float>(), reach_m);
      if (!nearest.has_value()) continue;
      const Eigen::Vector3d n = normals_[*nearest].cast<double>();
      pairs.push_back(
          {p.cast<double>(), n, n.dot(moved - thing_.points()[*nearest].cast<double>())});
    }
    if (pairs.size() < kFewestPairs) return T;
    const NormalStep step = StepOf(pairs, T, radius_m, kMinEigenvalueRatio);
    if (!step.step.allFinite()) return T;
    T = Normalized(Retract(T, step.step));
    if (step.step.norm() < kStill && reach_m <= reach_m_) break;
  }
  return T;
}

KindFit KindModel::Measure(const ThingPoints& thing,
                           const Pose& T_kind_thing,
                           std::size_t samples) const {
  KindFit fit;
  fit.T_kind_thing = T_kind_thing;
  const std::vector<Eigen::Vector3f> points = SamplesOf(thing, samples);
  std::size_t on = 0;
  double squares = 0.0;
  for (const Eigen::Vector3f& p : points) {
    const Eigen::Vector3f moved = (T_kind_thing * p.cast<double>()).cast<float>();
    const auto nearest = thing_.NearestTo(moved, reach_m_);
    if (!nearest.has_value()) continue;
    const double r = normals_[*nearest].dot(moved - thing_.points()[*nearest]);
    if (std::abs(r) > tolerance_m_) continue;
    ++on;
    squares += r * r;
  }
  if (on > 0) fit.residual_m = std::sqrt(squares / static_cast<double>(on));
  fit.overlap = static_cast<double>(on) / static_cast<double>(points.size());
  const Pose T_thing_kind = T_kind_thing.inverse();
  const double reach_m = std::max(reach_m_, kReachSpacings * thing.spacing_m());
  const std::vector<Eigen::Vector3f> own = SamplesOf(thing_, samples);
  const auto covered = std::count_if(own.begin(), own.end(), [&](const Eigen::Vector3f& p) {
    const Eigen::Vector3f moved = (T_thing_kind * p.cast<double>()).cast<float>();
    return thing.NearestTo(moved, reach_m).has_value();
  });
  fit.cover = static_cast<double>(covered) / static_cast<double>(own.size());
  return fit;
}

std::optional<KindFit> KindModel::Register(const ThingPoints& thing,
                                           const std::vector<Start>& starts) const {
  const double far_m =
      std::max(4.0 * reach_m_, 0.1 * thing_.bounds().sizes().cast<double>().norm());
  std::optional<KindFit> best;
  for (const Start& start : starts) {
    const Pose T = Refine(thing, start.T_kind_thing, kCoarseSamples, kCoarseIterations, far_m);
    const KindFit fit = Measure(thing, T, kCoarseSamples);
    if (!best.has_value() || fit.Badness(tolerance_m_) < best->Badness(tolerance_m_)) best = fit;
  }
  if (!best.has_value() || best->overlap < kLeastShare) return std::nullopt;
  const Pose T = Refine(thing, best->T_kind_thing, kFineSamples, kFineIterations, 2.0 * reach_m_);
  if (T(2, 2) < kLeastUprightness) return std::nullopt;
  return Measure(thing, T, kFineSamples);
}

}  // namespace strata
