#include "tests/support/simulator/simulated_drive.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "absl/strings/str_format.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/egomotion/geodesy.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

constexpr double kGravity = 9.80665;
constexpr double kStep = 1e-3;  // of numeric derivatives [s]

// What the path's parameter is: seconds of driving at full speed.
double ParameterAt(const DriveOptions& options, double time_s) {
  const double driven = std::max(0.0, time_s - options.begin_s - options.rest_s);
  return driven * driven / (driven + 2.0);
}

Eigen::Vector3d PlaceAt(const DriveOptions& options, double s) {
  constexpr double kW = 0.05;
  if (options.way) return options.way(s);
  return {60.0 * std::sin(kW * s), 40.0 * std::sin(2.0 * kW * s), 2.0 * std::sin(3.0 * kW * s)};
}

Eigen::Vector3d AheadAt(const DriveOptions& options, double s) {
  return (PlaceAt(options, s + 0.01) - PlaceAt(options, s - 0.01)).normalized();
}

// Of the IMU.
Eigen::Vector3d ImuPlace(const DriveOptions& options, double time_s) {
  return TrueBodyPose(options, time_s) * options.rig.imu_body_m;
}

Eigen::Vector3d BodyRate(const DriveOptions& options, double time_s) {
  const Eigen::Matrix3d before = TrueBodyPose(options, time_s - kStep).linear();
  const Eigen::Matrix3d after = TrueBodyPose(options, time_s + kStep).linear();
  return So3Log(before.transpose() * after) / (2.0 * kStep);
}

Eigen::Vector3d Draw(Random& random, double sigma) {
  Eigen::Vector3d v;
  for (double& number : v) number = sigma * random.Gaussian();
  return v;
}

ImuSample SampleImu(const DriveOptions& options, double time_s, Random& random) {
  const ImuModel& imu = options.rig.imu;
  const Eigen::Quaterniond mount =
      Eigen::AngleAxisd(options.yaw_mount_rad, Eigen::Vector3d::UnitZ()) *
      options.rig.R_body_imu.value_or(Eigen::Quaterniond::Identity());
  const double h = 10.0 * kStep;
  const Eigen::Vector3d acceleration =
      (ImuPlace(options, time_s + h) - 2.0 * ImuPlace(options, time_s) +
       ImuPlace(options, time_s - h)) /
      (h * h);
  const Eigen::Vector3d felt = TrueBodyPose(options, time_s).linear().transpose() *
                               (acceleration + kGravity * Eigen::Vector3d::UnitZ());
  const double root_hz = std::sqrt(options.imu_hz);
  ImuSample sample;
  sample.time_s = time_s;
  sample.angular_rate_rad_s =
      mount.conjugate() * BodyRate(options, time_s) + options.gyro_bias_rad_s;
  sample.angular_rate_rad_s += Draw(random, imu.gyro_noise * root_hz);
  sample.specific_force_m_s2 = mount.conjugate() * felt + options.accelerometer_bias_m_s2;
  sample.specific_force_m_s2 += Draw(random, imu.accelerometer_noise * root_hz);
  return sample;
}

WheelSample SampleWheels(const DriveOptions& options, double time_s, Random& random) {
  const Eigen::Vector3d before = TrueBodyPose(options, time_s - kStep).translation();
  const Eigen::Vector3d after = TrueBodyPose(options, time_s + kStep).translation();
  const double speed = (after - before).norm() / (2.0 * kStep);
  const bool stands = speed < 1e-9;
  const WheelModel& wheels = options.rig.wheels;
  WheelSample sample;
  sample.time_s = time_s;
  sample.speed_m_s = (1.0 + options.wheel_scale) * speed;
  if (!stands) sample.speed_m_s += wheels.speed_m_s * random.Gaussian();
  const double rate = BodyRate(options, time_s).z();
  sample.yaw_rate_rad_s = stands ? 0.0 : rate + wheels.yaw_rate_rad_s * random.Gaussian();
  return sample;
}

GpsFix SampleGps(const DriveOptions& options,
                 const LocalFrame& frame,
                 double time_s,
                 Random& random) {
  const Eigen::Vector3d antenna = TrueBodyPose(options, time_s) * options.rig.gps.antenna_body_m +
                                  Draw(random, options.gps_sigma_m);
  const GeodeticOrigin place = frame.ToEarth(antenna);
  return {time_s,
          place.latitude_rad,
          place.longitude_rad,
          place.altitude_m,
          Eigen::Vector3d::Constant(options.gps_sigma_m)};
}

}  // namespace

Pose TrueBodyPose(const DriveOptions& options, double time_s) {
  const double s = ParameterAt(options, time_s);
  const Eigen::Vector3d ahead = AheadAt(options, s);
  const Eigen::Vector3d left = Eigen::Vector3d::UnitZ().cross(ahead).normalized();
  Pose T = Pose::Identity();
  T.linear() << ahead, left, ahead.cross(left);
  T.translation() = PlaceAt(options, s);
  return T;
}

MotionLog SimulateDrive(const DriveOptions& options, std::uint64_t seed) {
  Random imu(seed), wheels(seed + 1), gps(seed + 2);
  const LocalFrame frame(options.origin);
  const auto times = [&](double hz, const auto& add) {
    const int count = static_cast<int>(options.seconds * hz);
    for (int i = 0; i <= count; ++i) add(options.begin_s + i / hz);
  };
  MotionLog log;
  times(options.imu_hz, [&](double t) { log.imu.push_back(SampleImu(options, t, imu)); });
  if (options.wheels) {
    times(options.wheel_hz,
          [&](double t) { log.wheels.push_back(SampleWheels(options, t, wheels)); });
  }
  times(options.fix_hz, [&](double t) { log.fixes.push_back(SampleGps(options, frame, t, gps)); });
  return log;
}

void WriteDrive(const MotionLog& log, const std::filesystem::path& folder) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  std::ofstream imu(folder / "imu.csv"), odom(folder / "odom.csv"), gps(folder / "gps.csv");
  imu << "stamp,frame,wx,wy,wz,ax,ay,az\n";
  for (const ImuSample& s : log.imu) {
    const Eigen::Vector3d& w = s.angular_rate_rad_s;
    const Eigen::Vector3d& f = s.specific_force_m_s2;
    imu << absl::StrFormat("%.6f,imu,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f\n",
                           s.time_s,
                           w.x(),
                           w.y(),
                           w.z(),
                           f.x(),
                           f.y(),
                           f.z());
  }
  odom << "stamp,vx,wz\n";
  for (const WheelSample& s : log.wheels) {
    odom << absl::StrFormat(
        "%.6f,%.9f,%.9f\n", s.time_s, s.speed_m_s, s.yaw_rate_rad_s.value_or(0.0));
  }
  gps << "stamp,status,lat,lon,alt,var_e,var_n,var_u\n";
  for (const GpsFix& fix : log.fixes) {
    const Eigen::Vector3d variance = fix.sigma_m.cwiseAbs2();
    gps << absl::StrFormat("%.6f,1,%.12f,%.12f,%.4f,%.6f,%.6f,%.6f\n",
                           fix.time_s,
                           fix.latitude_rad * kDegrees,
                           fix.longitude_rad * kDegrees,
                           fix.altitude_m,
                           variance.x(),
                           variance.y(),
                           variance.z());
  }
}

}  // namespace strata::testing
