#include "tests/experiments/simulated_car.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include <Eigen/Geometry>

#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "core/common/status.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"

namespace strata::testing {
namespace {

constexpr double kSpeedM_s = 8.0;
constexpr double kSensorM = 1.8;     // above the wheels
constexpr double kOdometryS = 30.0;  // with fixes, after which there are none

class NestedLoops {
 public:
  NestedLoops() {
    places_.push_back(At(0.0));
    lengths_.push_back(0.0);
    for (int i = 1; i <= 5 * kSteps; ++i) {
      places_.push_back(At(i / double{kSteps}));
      lengths_.push_back(lengths_.back() + (places_[i] - places_[i - 1]).norm());
    }
  }
  double length_m() const { return lengths_.back(); }
  Eigen::Vector3d operator()(double driven_s) const {
    const double way_m = std::clamp(kSpeedM_s * driven_s, 0.0, length_m() - 1e-6);
    const auto after = std::upper_bound(lengths_.begin(), lengths_.end(), way_m);
    const auto k = static_cast<std::size_t>(after - lengths_.begin());
    const double share = (way_m - lengths_[k - 1]) / (lengths_[k] - lengths_[k - 1]);
    // By the parameter and not by the chord, which would have corners.
    Eigen::Vector3d place = At((static_cast<double>(k - 1) + share) / kSteps);
    if (kSpeedM_s * driven_s < 0.0) place.x() += kSpeedM_s * driven_s;
    if (kSpeedM_s * driven_s > length_m()) place.x() += kSpeedM_s * driven_s - length_m();
    return place;
  }

 private:
  static constexpr int kSteps = 20'000;  // of a loop
  static Eigen::Vector3d At(double loop) {
    static constexpr double kSizes[] = {1.0, 0.66, 0.46, 0.32, 0.22};
    const double size = kSizes[std::min(4, static_cast<int>(loop))];
    const double angle = 2.0 * std::numbers::pi * (loop - std::floor(loop));
    const double end = loop >= 5.0 ? 0.0 : 1.0;
    return {
        150.0 * size * std::sin(end * angle), 125.0 * size * (1.0 - std::cos(end * angle)), 0.0};
  }
  std::vector<Eigen::Vector3d> places_;
  std::vector<double> lengths_;
};

// At so many seconds of the drive: a garage, and two bridges.
bool IsHidden(double t) {
  return (t > 110.0 && t < 150.0) || (t > 60.0 && t < 65.0) || (t > 200.0 && t < 206.0);
}

// ---- the world ----

Pose BodyAt(const DriveOptions& options, double t) {
  return TrueBodyPose(options, options.begin_s + t);
}

std::vector<Eigen::Vector3d> WaypointsOf(const DriveOptions& options) {
  std::vector<Eigen::Vector3d> waypoints;
  for (double t = options.rest_s; t < options.seconds; t += 0.25) {
    waypoints.push_back(BodyAt(options, t).translation());
  }
  return waypoints;
}

// Whether it stands on the way that the car comes along more than 5 s before or after `t`.
bool BlocksOtherWays(const DriveOptions& options, double t, const Eigen::Vector3d& place) {
  for (double other = options.rest_s; other < options.seconds; other += 0.1) {
    if (std::abs(other - t) < 5.0) continue;
    const Eigen::Vector3d off = BodyAt(options, other).translation() - place;
    if (off.head<2>().norm() < 5.0) return true;
  }
  return false;
}

// A roof over the way where GPS is hidden, on columns and pieces of wall; not where it would stand
// on another loop, whose fixes are good.
void AddRoofs(const DriveOptions& options, Random& random, Scene& scene) {
  constexpr double kHalfWidthM = 5.0, kHeightM = 4.5;
  for (double t = 0.0; t < options.seconds; t += 1.0) {
    const double wall_m = random.Uniform(0.0, 1.0) < 0.5 ? random.Uniform(3.0, 7.0) : 0.5;
    const double side = random.Uniform(0.0, 1.0) < 0.5 ? 1.0 : -1.0;
    if (!IsHidden(t)) continue;
    const Pose T_world_car = BodyAt(options, t);
    const auto add = [&](const Eigen::Vector3d& p_car, const Eigen::Vector3d& size) {
      const Pose T = T_world_car * Eigen::Translation3d(p_car);
      if (!BlocksOtherWays(options, t, T.translation())) {
        scene.Add(Labelled(OrientedBox(T, size), kWall));
      }
    };
    add({0.0, 0.0, kHeightM}, {8.5, 2.0 * kHalfWidthM, 0.3});
    add({0.0, side * kHalfWidthM, 0.5 * kHeightM}, {wall_m, 0.3, kHeightM});
    add({0.0, -side * kHalfWidthM, 0.5 * kHeightM}, {0.5, 0.5, kHeightM});
  }
}

Scene CarScene(const DriveOptions& options, std::uint64_t seed) {
  constexpr int kHouses = 60, kTrees = 220;
  const Eigen::AlignedBox2d area(Eigen::Vector2d(-190.0, -40.0), Eigen::Vector2d(190.0, 290.0));
  Random random(seed + 99);
  Scene scene =
      PlantCampus({{"car", WaypointsOf(options)}}, area, kHouses, kTrees, random.Bits()).scene;
  AddRoofs(options, random, scene);
  scene.Build();
  return scene;
}

// ---- files ----

void WriteLogs(const DriveOptions& options,
               const MotionLog& log,
               const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "log");
  std::filesystem::create_directories(folder / "odometry");
  WriteDrive(log, folder / "log");
  MotionLog odometry = log;
  std::erase_if(odometry.fixes,
                [&](const GpsFix& fix) { return fix.time_s > options.begin_s + kOdometryS; });
  WriteDrive(odometry, folder / "odometry");
}

std::string RigText(const Rig& rig) {
  return absl::StrFormat(
      "imu:\n  orientation: [0, 0, 0]\n  gyro_noise: %g\n  accelerometer_noise: %g\n",
      rig.imu.gyro_noise,
      rig.imu.accelerometer_noise);
}

std::string TumLine(double time_s, const Pose& T) {
  const Eigen::Quaterniond q(T.linear());
  return absl::StrFormat("%.6f %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n",
                         time_s,
                         T.translation().x(),
                         T.translation().y(),
                         T.translation().z(),
                         q.x(),
                         q.y(),
                         q.z(),
                         q.w());
}

std::vector<double> ScanTimes(const DriveOptions& options, double step_m) {
  std::vector<double> times;
  Eigen::Vector3d last = Eigen::Vector3d::Constant(1e9);
  for (int k = static_cast<int>(100.0 * options.rest_s); k < 100.0 * (options.seconds - 0.5); ++k) {
    const Eigen::Vector3d place = BodyAt(options, 0.01 * k).translation();
    if ((place - last).norm() < step_m) continue;
    last = place;
    times.push_back(options.begin_s + 0.01 * k);
  }
  return times;
}

}  // namespace

DriveOptions CarDrive(bool on_terrain) {
  const auto loops = std::make_shared<const NestedLoops>();
  DriveOptions options;
  options.way = [loops, on_terrain](double driven_s) {
    Eigen::Vector3d place = (*loops)(driven_s);
    if (on_terrain) place.z() = CampusHeight(place.x(), place.y());
    return place;
  };
  options.seconds = options.rest_s + 2.0 + loops->length_m() / kSpeedM_s;
  options.fix_hz = 5.0;
  options.rig.R_body_imu = Eigen::Quaterniond::Identity();
  options.rig.imu.gyro_noise = 2e-3;
  options.rig.imu.accelerometer_noise = 0.03;
  return options;
}

double CarWayM() { return NestedLoops().length_m(); }

Urban AmongWalls(const DriveOptions& options, std::uint64_t seed) {
  Urban urban;
  urban.log = SimulateDrive(options, seed);
  Random random(seed + 77);
  std::vector<GpsFix> fixes;
  double jump_until_s = 0.0;
  Eigen::Vector2d jump_m = Eigen::Vector2d::Zero();
  for (GpsFix fix : urban.log.fixes) {
    const double t = fix.time_s - options.begin_s;
    if (IsHidden(t)) continue;
    Eigen::Vector2d off = Eigen::Vector2d::Zero();
    if (t > 40.0 && fix.time_s >= jump_until_s && random.Uniform(0.0, 1.0) < 0.04) {
      const double length_s = random.Uniform(1.0, 4.0);
      const double direction = random.Uniform(0.0, 2.0 * std::numbers::pi);
      const double size_m = random.Uniform(8.0, 30.0);
      jump_until_s = fix.time_s + length_s;
      jump_m = size_m * Eigen::Vector2d(std::cos(direction), std::sin(direction));
    }
    if (fix.time_s < jump_until_s) off += jump_m;
    const bool bad = off.norm() > 5.0;
    if (t > 230.0 && t < 250.0) off.x() += 4.0 * std::sin(std::numbers::pi * (t - 230.0) / 20.0);
    fix.longitude_rad += off.x() / (kEarthM * std::cos(fix.latitude_rad));
    fix.latitude_rad += off.y() / kEarthM;
    fixes.push_back(fix);
    urban.bad.push_back(bad);
  }
  urban.log.fixes = std::move(fixes);
  return urban;
}

absl::StatusOr<WrittenCar> WriteCar(const DriveOptions& options,
                                    const Urban& urban,
                                    double step_m,
                                    std::uint64_t seed,
                                    const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "scans");
  WriteLogs(options, urban.log, folder);
  STRATA_RETURN_IF_ERROR(WriteFileBytes(folder / "rig.yaml", RigText(options.rig)));
  const Scene scene = CarScene(options, seed);
  SensorOptions sensor;
  sensor.rings = 32;
  sensor.columns = 600;
  std::string truth;
  WrittenCar written;
  for (const double time_s : ScanTimes(options, step_m)) {
    const Pose T = TrueBodyPose(options, time_s) * Eigen::Translation3d(0.0, 0.0, kSensorM);
    const PointCloud cloud = SimulateScan(scene, sensor, T, seed + 1000003 * ++written.scans);
    written.points += cloud.size();
    STRATA_ASSIGN_OR_RETURN(const std::string bytes, PcdBytes(GeometryOf(cloud)));
    STRATA_RETURN_IF_ERROR(
        WriteFileBytes(folder / "scans" / absl::StrFormat("%.6f.pcd", time_s), bytes));
    truth += TumLine(time_s, T);
  }
  STRATA_RETURN_IF_ERROR(WriteFileBytes(folder / "truth.txt", truth));
  return written;
}

}  // namespace strata::testing
