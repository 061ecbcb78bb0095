#include "core/planes/models/plane_mixture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "core/common/random.h"
#include "core/common/stop.h"
#include "core/planes/models/model_selection.h"
#include "core/planes/models/plane_colour.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using testing::Random;

// Cells of a surface of 4 x 4 m around `middle`, perpendicular to `normal`, `sigma_m` off it.
std::vector<MixtureCell> CellsOf(const Eigen::Vector3d& normal,
                                 const Eigen::Vector3d& middle,
                                 double sigma_m,
                                 Random& random) {
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  std::vector<MixtureCell> cells;
  for (int i = 0; i < 80; ++i) {
    MixtureCell cell;
    const double off = sigma_m * random.Gaussian();
    const double along = random.Uniform(-2.0, 2.0);
    const double across = random.Uniform(-2.0, 2.0);
    cell.mean = middle + off * normal + along * u + across * v;
    cell.covariance = 0.01 * (u * u.transpose() + v * v.transpose());
    cell.measurements = 2.0;
    cell.variance_m2 = 4e-4;
    cell.area_m2 = 0.1;
    cells.push_back(cell);
  }
  return cells;
}

struct World {
  std::vector<MixtureCell> cells;
  std::vector<MixturePlane> planes;
};

// Surfaces with these normals, 10 m apart; each plane begins some degrees off.
World WorldOf(const std::vector<Eigen::Vector3d>& normals, double sigma_m, std::uint64_t seed) {
  Random random(seed);
  World world;
  for (std::size_t m = 0; m < normals.size(); ++m) {
    const Eigen::Vector3d n = normals[m].normalized();
    const Eigen::Vector3d middle(10.0 * static_cast<double>(m), 0.0, 0.0);
    MixturePlane plane;
    for (const MixtureCell& cell : CellsOf(n, middle, sigma_m, random)) {
      plane.voxels.push_back(VoxelOf(cell.mean));
      world.cells.push_back(cell);
    }
    std::sort(plane.voxels.begin(), plane.voxels.end());
    plane.voxels.erase(std::unique(plane.voxels.begin(), plane.voxels.end()), plane.voxels.end());
    Eigen::Vector3d off;
    for (double& x : off) x = random.Gaussian();
    plane.plane.normal = (n + 0.02 * off).normalized();
    plane.plane.distance = plane.plane.normal.dot(middle);
    world.planes.push_back(plane);
  }
  return world;
}

PlaneMixture MixtureOf(const World& world, const MixtureOptions& options = {}) {
  PlaneMixture mixture(world.cells, options);
  mixture.planes = world.planes;
  for (const MixturePlane& plane : world.planes) mixture.AddDirection(plane.plane.normal);
  mixture.Prepare();
  return mixture;
}

TEST(PlaneMixture, ObjectiveNeverFalls) {
  for (const std::uint64_t seed : {3U, 4U, 5U}) {
    SCOPED_TRACE(seed);
    PlaneMixture mixture =
        MixtureOf(WorldOf({{1, 0, 0}, {std::cos(0.07), std::sin(0.07), 0}, {0, 0, 1}}, 0.02, seed));
    const double first = mixture.LogLikelihood();
    double last = first;
    for (int step = 0; step < 30; ++step) {
      const double expected = mixture.ExpectedLogLikelihood();
      mixture.MStep();
      EXPECT_GE(mixture.ExpectedLogLikelihood(), expected - 1e-9 * std::abs(expected)) << step;
      mixture.EStep();
      EXPECT_GE(mixture.LogLikelihood(), last - 1e-9 * std::abs(last)) << step;
      last = mixture.LogLikelihood();
    }
    EXPECT_GT(last, first + 1.0);
  }
}

// Two colours on one surface, and a reflection on it: each plane keeps its own.
TEST(PlaneMixture, WithColoursTheObjectiveNeverFallsEither) {
  for (const std::uint64_t seed : {16U, 17U}) {
    SCOPED_TRACE(seed);
    World world = WorldOf({{0, 0, 1}, {0, 0.02, 1}}, 0.02, seed);
    const LabColour colours[2] = {LabOf({160, 40, 40}), LabOf({150, 150, 150})};
    Random random(seed + 10);
    for (std::size_t j = 0; j < world.cells.size(); ++j) {
      MixtureCell& cell = world.cells[j];
      const int own = cell.mean.x() > 5.0 ? 1 : 0;
      cell.mean.x() -= 10.0 * own;  // onto the other
      cell.colour = j % 20 == 0 ? LabOf({220, 180, 40}) : colours[own];
      for (double& x : cell.colour) x += 4.0 * random.Gaussian();
      cell.colour_variance = 30.0;
    }
    for (int m = 0; m < 2; ++m) {
      world.planes[m].voxels = world.planes[0].voxels;
      world.planes[m].plane = {Eigen::Vector3d::UnitZ(), 0.01 * m};
      world.planes[m].colour = colours[m] + LabColour(5, 5, -5);
    }
    MixtureOptions options;
    options.colour = true;
    PlaneMixture mixture = MixtureOf(world, options);
    double last = mixture.LogLikelihood();
    for (int step = 0; step < 30; ++step) {
      const double expected = mixture.ExpectedLogLikelihood();
      mixture.MStep();
      EXPECT_GE(mixture.ExpectedLogLikelihood(), expected - 1e-9 * std::abs(expected)) << step;
      mixture.EStep();
      EXPECT_GE(mixture.LogLikelihood(), last - 1e-9 * std::abs(last)) << step;
      last = mixture.LogLikelihood();
    }
    for (int m = 0; m < 2; ++m) EXPECT_LT((mixture.planes[m].colour - colours[m]).norm(), 2.5);
    int right = 0, of = 0;
    for (std::size_t j = 0; j < world.cells.size(); ++j) {
      if (j % 20 == 0) continue;
      ++of;
      right += mixture.PlaneOf(j) == (j < 80 ? 0U : 1U) ? 1 : 0;
    }
    EXPECT_GT(right, 0.95 * of);
  }
}

// 6 M + 2 K, and a direction's chance (0132).
TEST(ModelSelection, AColourCostsThreeParameters) {
  const World world = WorldOf({{1, 0, 0}, {0, 0, 1}}, 0.01, 18);
  MixtureOptions options;
  const PlaneMixture plain = MixtureOf(world, options);
  options.colour = true;
  const PlaneMixture coloured = MixtureOf(world, options);
  const double ln_n = std::log(plain.measurements());
  EXPECT_NEAR(Bic(plain) + 2.0 * plain.LogLikelihood(), (3 * 2 + 3 * 2) * ln_n, 1e-9);
  EXPECT_NEAR(Bic(coloured) + 2.0 * coloured.LogLikelihood(), (6 * 2 + 3 * 2) * ln_n, 1e-9);
}

// What an M-step maximises, for a solver that knows nothing of its closed form: the thesis'
// conjugate gradients (5.4.1) over normals and directions on spheres, and distances.
class Negative final : public ceres::FirstOrderFunction {
 public:
  explicit Negative(PlaneMixture& mixture) : mixture_(mixture) {}
  int NumParameters() const override {
    return static_cast<int>(4 * mixture_.planes.size() + 3 * mixture_.directions.size());
  }
  bool Evaluate(const double* x, double* cost, double* gradient) const override {
    *cost = At(x);
    if (gradient == nullptr) return true;
    std::vector<double> y(x, x + NumParameters());
    constexpr double kStep = 1e-6;
    for (int i = 0; i < NumParameters(); ++i) {
      y[i] = x[i] + kStep;
      const double after = At(y.data());
      y[i] = x[i] - kStep;
      gradient[i] = (after - At(y.data())) / (2.0 * kStep);
      y[i] = x[i];
    }
    return true;
  }
  // Normals need not be unit: they are made so.
  void Set(const double* x) const {
    for (MixturePlane& plane : mixture_.planes) {
      plane.plane.normal = Eigen::Map<const Eigen::Vector3d>(x).normalized();
      plane.plane.distance = x[3];
      x += 4;
    }
    for (Eigen::Vector3d& direction : mixture_.directions) {
      direction = Eigen::Map<const Eigen::Vector3d>(x).normalized();
      x += 3;
    }
  }

 private:
  double At(const double* x) const {
    Set(x);
    return -mixture_.ExpectedLogLikelihood();
  }
  PlaneMixture& mixture_;
};

TEST(PlaneMixture, ClosedFormIsWhatASolverFinds) {
  PlaneMixture mixture =
      MixtureOf(WorldOf({{1, 0, 0}, {std::cos(0.03), std::sin(0.03), 0}, {0, 0.3, 1}}, 0.02, 7));
  for (int turn = 0; turn < 200; ++turn) mixture.MStep();  // for the same expectations
  const double closed = mixture.ExpectedLogLikelihood();
  std::vector<double> x;
  Random random(8);
  for (const MixturePlane& plane : mixture.planes) {
    for (const double n : plane.plane.normal) x.push_back(n + 0.01 * random.Gaussian());
    x.push_back(plane.plane.distance + 0.01);
  }
  for (const Eigen::Vector3d& direction : mixture.directions) {
    for (const double d : direction) x.push_back(d + 0.01 * random.Gaussian());
  }
  auto* function = new Negative(mixture);  // owned by the problem
  ceres::GradientProblem problem(function);
  ceres::GradientProblemSolver::Options options;
  options.line_search_direction_type = ceres::NONLINEAR_CONJUGATE_GRADIENT;
  options.nonlinear_conjugate_gradient_type = ceres::FLETCHER_REEVES;
  options.max_num_iterations = 5000;
  options.function_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::GradientProblemSolver::Summary summary;
  ceres::Solve(options, problem, x.data(), &summary);
  EXPECT_NEAR(-summary.final_cost, closed, 1e-6 * std::abs(closed)) << summary.BriefReport();
  EXPECT_LE(-summary.final_cost, closed + 1e-9 * std::abs(closed));
}

// Walls two degrees apart, each measured as well as a square metre of it, and a slanted one.
TEST(PlaneMixture, NearlyParallelPlanesBecomeParallelAndOthersStay) {
  World world =
      WorldOf({{1, 0.02, 0}, {1, 0, 0.02}, {1, -0.015, 0}, {1, 0, 0}, {0.5, 0.5, 0.7}}, 0.02, 9);
  for (MixtureCell& cell : world.cells) cell.measurements = 0.02;
  const auto spread_with = [&world](bool directions) {
    MixtureOptions options;
    options.directions = directions;
    PlaneMixture mixture = MixtureOf(world, options);
    STRATA_EXPECT_OK(mixture.Run(200, Stop()));
    const Eigen::Vector3d slanted = Eigen::Vector3d(0.5, 0.5, 0.7).normalized();
    EXPECT_GT(std::abs(mixture.planes[4].plane.normal.dot(slanted)), std::cos(0.02));
    double most = 0.0;
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < a; ++b) {
        const double cosine =
            std::abs(mixture.planes[a].plane.normal.dot(mixture.planes[b].plane.normal));
        most = std::max(most, std::acos(std::min(1.0, cosine)));
      }
    }
    return most;
  };
  EXPECT_LT(spread_with(true), 0.5 * spread_with(false));
}

TEST(ModelSelection, APlaneThatIsThereTwiceGoes) {
  World world = WorldOf({{1, 0, 0}, {0, 0, 1}}, 0.01, 11);
  world.planes.push_back(world.planes[0]);
  world.planes.back().plane.distance += 0.005;
  PlaneMixture mixture = MixtureOf(world);
  STRATA_ASSERT_OK(mixture.Run(100, Stop()));
  const double before = Bic(mixture);
  STRATA_ASSERT_OK_AND_ASSIGN(const bool dropped, DropPlanes(mixture, Stop()));
  EXPECT_TRUE(dropped);
  EXPECT_EQ(mixture.planes.size(), 2U);
  STRATA_ASSERT_OK(mixture.Run(100, Stop()));
  EXPECT_LT(Bic(mixture), before);
  STRATA_ASSERT_OK_AND_ASSIGN(const bool more, DropPlanes(mixture, Stop()));
  EXPECT_FALSE(more);
}

TEST(ModelSelection, WhatNoPlaneExplainsGetsOne) {
  World world = WorldOf({{1, 0, 0}, {0, 0, 1}}, 0.01, 13);
  const Eigen::Vector3d truth = world.planes[1].plane.normal;
  world.planes.pop_back();
  PlaneMixture mixture = MixtureOf(world);
  STRATA_ASSERT_OK(mixture.Run(100, Stop()));
  const double before = Bic(mixture);
  SplitMix64 random(1);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::size_t added, AddPlanes(mixture, 10, random, Stop()));
  EXPECT_EQ(added, 1U);
  STRATA_ASSERT_OK(mixture.Run(100, Stop()));
  EXPECT_LT(Bic(mixture), before);
  EXPECT_GT(std::abs(mixture.planes.back().plane.normal.dot(truth)), std::cos(0.1));
}

TEST(PlaneMixture, EndsWhenAsked) {
  PlaneMixture mixture = MixtureOf(WorldOf({{1, 0, 0}}, 0.01, 15));
  const Stop stop;
  stop.Request();
  EXPECT_TRUE(absl::IsCancelled(mixture.Run(10, stop)));
}

}  // namespace
}  // namespace strata
