// A piano stool on a table, looked at by a manipulator with a laser that measures in a plane
// (thesis 4.4.2, "Implementation"): a box of 1 m, cells of 1 cm, sub-paths that sweep the plane
// from edge to edge of the box, the best of the ten nearest each time, of which the others are
// dropped, so that a tenth of all are executed at most. Drawn: an elbow on a half sphere of 1.3 m
// around the shoulder beside the box, the laser 0.25 m from it with its plane across the forearm.
//   known     of the cells over the table that all sub-paths together tell of
//   random    sub-paths executed in random order until as much is known, median of the seeds
// Exits 1 unless all is known, to 0.1 %, after no more than 42, and random takes 1.5 times as many.
//
//   explore_stool [--horizon H] [--least BITS] [--lambda BITS] [--elbows N]
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numbers>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/cloud/field_of_view.h"
#include "core/cloud/sensor_model.h"
#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/occupancy/expected_view.h"
#include "core/occupancy/occupancy_voxels.h"
#include "tests/experiments/meshes/stool.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

using Eigen::Vector3d;

constexpr double kCellM = 0.01;
constexpr int kSide = 100;  // cells of the box along each axis
constexpr double kForearmM = 0.25;
constexpr double kStepRad = 0.01;  // of a sweep, executed; a cell at a metre
constexpr int kLookEvery = 6;      // of these, where a sweep is only thought of
constexpr int kColumns = 720;
constexpr int kSeeds = 21;
const Vector3d kShoulder(-0.8, 0.0, 0.3);
constexpr double kUpperArmM = 1.3;

const Eigen::AlignedBox3d& GridBox() {
  static const Eigen::AlignedBox3d box(Vector3d(-0.5, -0.5, 0.0), Vector3d(0.5, 0.5, 1.0));
  return box;
}

// The stool of table 4.1 on a table in a room.
testing::Scene StoolOnTable() {
  testing::Scene scene;
  const testing::Scene stool = testing::Stool();
  for (const testing::Solid& solid : stool.solids()) scene.Add(solid);
  scene.Add(testing::Box({-0.6, -0.6, -0.05}, {0.6, 0.6, 0.0}));
  const double far = 4.0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      Vector3d low = Vector3d::Constant(-far);
      Vector3d high = Vector3d::Constant(far);
      low[axis] = side > 0.0 ? far : -far - 0.1;
      high[axis] = low[axis] + 0.1;
      scene.Add(testing::Box(low, high));
    }
  }
  scene.Build();
  return scene;
}

// A place of the laser: z is across its plane.
Pose LaserAt(const Vector3d& elbow, const Vector3d& normal) {
  Pose T = Pose::Identity();
  T.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), normal).toRotationMatrix();
  T.translation() = elbow + kForearmM * normal;
  return T;
}

// A sweep about an elbow, its plane along one axis all the way.
struct SubPath {
  std::vector<Pose> poses;
  std::vector<bool> tells;  // of the cells of the box
  double clear_m = 0.0;     // from the box, the nearest that the laser comes
};

// Angles about `axis` at which the laser's plane goes through one of the four edges along it; the
// two planes of each edge apart.
std::array<std::vector<double>, 2> TangentAngles(const Vector3d& elbow, int axis) {
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  std::array<std::vector<double>, 2> angles;
  for (int corner = 0; corner < 4; ++corner) {
    const double du = ((corner & 1) != 0 ? GridBox().max() : GridBox().min())[u] - elbow[u];
    const double dv = ((corner & 2) != 0 ? GridBox().max() : GridBox().min())[v] - elbow[v];
    const double away = std::hypot(du, dv);
    if (away <= kForearmM) continue;
    const double towards = std::atan2(dv, du);
    const double open = std::acos(kForearmM / away);
    angles[0].push_back(towards + open);
    angles[1].push_back(towards - open);
  }
  return angles;
}

// From the first to the last of the angles, across the box; empty where the arm would touch it or
// the table.
std::vector<Pose> Sweep(const Vector3d& elbow, int axis, std::vector<double> angles) {
  std::vector<Pose> poses;
  if (angles.size() < 4) return poses;
  for (double& angle : angles) {  // near each other
    while (angle - angles[0] > std::numbers::pi) angle -= 2.0 * std::numbers::pi;
    while (angle - angles[0] < -std::numbers::pi) angle += 2.0 * std::numbers::pi;
  }
  const auto [low, high] = std::minmax_element(angles.begin(), angles.end());
  const int steps = static_cast<int>((*high - *low) / kStepRad) + 1;
  for (int i = 0; i <= steps; ++i) {
    const double angle = *low + (*high - *low) * i / steps;
    Vector3d normal = Vector3d::Zero();
    normal[(axis + 1) % 3] = std::cos(angle);
    normal[(axis + 2) % 3] = std::sin(angle);
    poses.push_back(LaserAt(elbow, normal));
    const Vector3d& at = poses.back().translation();
    const bool over_table = at.head<2>().cwiseAbs().maxCoeff() < 0.65;
    if (at.z() < (over_table ? 0.05 : -0.5) || GridBox().exteriorDistance(at) < 0.02) return {};
  }
  return poses;
}

// Evenly over the half sphere, as far from the box as the forearm is long.
std::vector<Vector3d> Elbows(int count) {
  constexpr double kGoldenRad = 2.399963229728653;
  std::vector<Vector3d> elbows;
  for (int i = 0; i < count; ++i) {
    const double z = (i + 0.5) / count;
    const double r = std::sqrt(1.0 - z * z);
    const Vector3d up(r * std::cos(i * kGoldenRad), r * std::sin(i * kGoldenRad), z);
    const Vector3d elbow = kShoulder + kUpperArmM * up;
    if (GridBox().exteriorDistance(elbow) > kForearmM + 0.02) elbows.push_back(elbow);
  }
  return elbows;
}

SensorModel Laser() {
  SensorModel laser;
  laser.max_range_m = 10.0;
  return laser;
}

void Execute(const testing::Scene& scene,
             const SubPath& path,
             std::uint64_t seed,
             OccupancyVoxels& grid) {
  testing::SensorOptions sensor;
  sensor.rings = 1;
  sensor.columns = kColumns;
  sensor.elevation_min_rad = sensor.elevation_max_rad = 0.0;
  sensor.min_range_m = 0.02;
  sensor.max_range_m = 10.0;
  sensor.sigma_m = 0.001;
  sensor.sigma_per_metre = 0.0;
  for (const Pose& pose : path.poses) {
    const PointCloud scan = testing::SimulateScan(scene, sensor, pose, ++seed);
    const absl::Status added = grid.Add(scan, pose, Laser(), Stop());
    if (!added.ok()) std::fprintf(stderr, "%s\n", added.ToString().c_str());
  }
}

OccupancyVoxels NewGrid(const Eigen::AlignedBox3d& region) {
  OccupancyVoxelsOptions options;
  options.voxel_m = kCellM;
  options.model = InverseSensorModel::OfOneLook();
  options.model.hits_stay = false;  // the thesis' model: cells here are fine, and beams not grazing
  options.region = region;
  return OccupancyVoxels(options);
}

// Which cells of the box a grid knows.
std::vector<bool> KnownIn(const OccupancyVoxels& grid) {
  std::vector<bool> known(static_cast<std::size_t>(kSide) * kSide * kSide);
  OccupancyReader reader(grid);
  std::size_t n = 0;
  for (int z = 0; z < kSide; ++z) {
    for (int y = -kSide / 2; y < kSide / 2; ++y) {
      for (int x = -kSide / 2; x < kSide / 2; ++x, ++n) {
        known[n] = reader.Odds({x, y, z}) != OccupancyVoxels::kUnknownOdds;
      }
    }
  }
  return known;
}

std::vector<SubPath> AllSubPaths(const testing::Scene& scene, int elbows) {
  std::vector<SubPath> paths;
  for (const Vector3d& elbow : Elbows(elbows)) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const std::vector<double>& angles : TangentAngles(elbow, axis)) {
        SubPath path;
        path.poses = Sweep(elbow, axis, angles);
        if (path.poses.empty()) continue;
        path.clear_m = 1e9;
        for (const Pose& pose : path.poses) {
          path.clear_m =
              std::min(path.clear_m, GridBox().exteriorDistance(Vector3d(pose.translation())));
        }
        OccupancyVoxels alone = NewGrid(GridBox());
        Execute(scene, path, 1000 * paths.size(), alone);
        path.tells = KnownIn(alone);
        paths.push_back(std::move(path));
      }
    }
  }
  return paths;
}

// What is known, cell by cell.
class Known {
 public:
  void Add(const std::vector<bool>& tells) {
    if (known_.empty()) known_.resize(tells.size());
    for (std::size_t i = 0; i < tells.size(); ++i) {
      if (!tells[i] || known_[i]) continue;
      known_[i] = true;
      ++count_;
    }
  }
  bool Has(std::size_t cell) const { return known_[cell]; }
  std::size_t count() const { return count_; }

 private:
  std::vector<bool> known_;
  std::size_t count_ = 0;
};

struct Options {
  std::size_t horizon = 10;
  double least_bits = 150.0;
  double lambda_bits = 20.0;
  int elbows = 90;
};

// Eq. 4.15, of a sweep in every kLookEvery-th place of it.
double UtilityOf(const OccupancyVoxels& grid, const SubPath& path, const Options& options) {
  FieldOfView laser;
  laser.up_rad = laser.down_rad = 0.0;
  laser.rows = 1;
  laser.columns = kColumns / 2;
  laser.max_range_m = 3.0;
  ExpectedViews views(grid, laser, GridBox());
  double bits = 0.0;
  for (std::size_t i = 0; i < path.poses.size(); i += kLookEvery) {
    bits += views.Follow(path.poses[i]).bits;
    views.Take();
  }
  return bits - options.lambda_bits / path.clear_m;
}

struct Explored {
  std::size_t executed = 0;
  std::vector<double> shares;  // known after each
};

// The best of the nearest, group by group.
Explored Explore(const testing::Scene& scene,
                 const std::vector<SubPath>& paths,
                 std::size_t all,
                 const Options& options) {
  Eigen::AlignedBox3d around = GridBox();
  for (const SubPath& path : paths) {
    for (const Pose& pose : path.poses) around.extend(Vector3d(pose.translation()));
  }
  around.extend(around.min() - Vector3d::Constant(0.1));
  around.extend(around.max() + Vector3d::Constant(0.1));
  OccupancyVoxels grid = NewGrid(around);
  Known known;
  Explored explored;
  Vector3d arm = kShoulder + Vector3d(0.0, 0.0, kUpperArmM);
  std::vector<std::size_t> left(paths.size());
  std::iota(left.begin(), left.end(), 0);
  while (!left.empty()) {
    std::stable_sort(left.begin(), left.end(), [&](std::size_t a, std::size_t b) {
      const auto away = [&](const SubPath& path) {
        return (path.poses.front().translation() - arm).squaredNorm();
      };
      return away(paths[a]) < away(paths[b]);
    });
    const std::size_t group = std::min(options.horizon, left.size());
    std::size_t best = 0;
    double utility = options.least_bits;
    bool found = false;
    for (std::size_t i = 0; i < group; ++i) {
      const double of_it = UtilityOf(grid, paths[left[i]], options);
      if (of_it <= utility) continue;
      utility = of_it;
      best = left[i];
      found = true;
    }
    left.erase(left.begin(), left.begin() + static_cast<std::ptrdiff_t>(group));
    if (!found) continue;
    Execute(scene, paths[best], 1000 * best, grid);
    known.Add(paths[best].tells);
    arm = paths[best].poses.back().translation();
    ++explored.executed;
    explored.shares.push_back(static_cast<double>(known.count()) / static_cast<double>(all));
  }
  return explored;
}

// How many in random order until so many cells are known.
std::size_t AtRandom(const std::vector<SubPath>& paths, std::size_t wanted, unsigned seed) {
  std::vector<std::size_t> order(paths.size());
  std::iota(order.begin(), order.end(), 0);
  std::mt19937 random(seed);
  for (std::size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[random() % (i + 1)]);
  Known known;
  for (std::size_t n = 0; n < order.size(); ++n) {
    known.Add(paths[order[n]].tells);
    if (known.count() >= wanted) return n + 1;
  }
  return order.size();
}

// Cells that nothing tells of, though they are no part of the stool.
std::size_t HiddenOutside(const testing::Scene& scene, const Known& all) {
  std::size_t hidden = 0;
  std::size_t n = 0;
  for (int z = 0; z < kSide; ++z) {
    for (int y = -kSide / 2; y < kSide / 2; ++y) {
      for (int x = -kSide / 2; x < kSide / 2; ++x, ++n) {
        if (all.Has(n)) continue;
        const Vector3d middle = kCellM * Vector3d(x + 0.5, y + 0.5, z + 0.5);
        const auto holds = [&](const testing::Solid& solid) {
          return std::all_of(solid.faces.begin(), solid.faces.end(), [&](const auto& face) {
            return face.normal.dot(middle) <= face.offset;
          });
        };
        const auto& solids = scene.solids();
        hidden += std::none_of(solids.begin(), solids.end(), holds) ? 1 : 0;
      }
    }
  }
  return hidden;
}

bool Says(bool holds, const char* what) {
  std::printf("%s: %s\n", holds ? "holds" : "FAILS", what);
  return holds;
}

bool Run(const Options& options) {
  const testing::Scene scene = StoolOnTable();
  const std::vector<SubPath> paths = AllSubPaths(scene, options.elbows);
  Known all;
  for (const SubPath& path : paths) all.Add(path.tells);
  const std::size_t most = (paths.size() + options.horizon - 1) / options.horizon;
  std::printf(
      "%zu sub-paths (thesis 424), %zu may be executed (42); they tell of %zu of %d cells\n",
      paths.size(),
      most,
      all.count(),
      kSide * kSide * kSide);
  std::printf("of the others %zu are not inside of the stool\n", HiddenOutside(scene, all));
  const Explored explored = Explore(scene, paths, all.count(), options);
  for (std::size_t i = 0; i < explored.shares.size(); ++i) {
    if (i % 4 == 0 || i + 1 == explored.shares.size()) {
      std::printf("  after %2zu: %.3f %% known\n", i + 1, 100.0 * explored.shares[i]);
    }
  }
  const double share = explored.shares.empty() ? 0.0 : explored.shares.back();
  std::vector<std::size_t> at_random;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const auto wanted = static_cast<std::size_t>(share * static_cast<double>(all.count()) - 0.5);
    at_random.push_back(AtRandom(paths, wanted, seed));
  }
  std::sort(at_random.begin(), at_random.end());
  const std::size_t median = at_random[kSeeds / 2];
  std::printf("executed %zu (thesis 16); at random %zu to %zu, median %zu\n",
              explored.executed,
              at_random.front(),
              at_random.back(),
              median);
  bool holds = Says(share >= 0.999, "all that can be known over the table is, to 0.1 %");
  holds =
      Says(explored.executed <= most && explored.executed <= 42, "no more are executed than 42") &&
      holds;
  return Says(static_cast<double>(median) >= 1.5 * static_cast<double>(explored.executed),
              "random order takes 1.5 times as many") &&
         holds;
}

}  // namespace

int Main(int argc, char** argv) {
  CLI::App app("A stool on a table, explored by a manipulator");
  Options options;
  app.add_option("--horizon", options.horizon, "Sub-paths that are compared")
      ->capture_default_str();
  app.add_option("--least", options.least_bits, "Less is not worth a sub-path [bits]")
      ->capture_default_str();
  app.add_option("--lambda", options.lambda_bits, "Of the cost 1 / distance from the box [bits m]")
      ->capture_default_str();
  app.add_option("--elbows", options.elbows, "Places on the half sphere")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return Run(options) ? 0 : 1;
}

}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
