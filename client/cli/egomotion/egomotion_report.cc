#include "client/cli/egomotion/egomotion_report.h"

#include <numbers>

#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "client/cli/terminal/json.h"
#include "core/geometry/euler.h"

namespace strata::cli {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

Json AnglesOf(const Eigen::Quaterniond& rotation) {
  const EulerAngles euler = EulerOf(rotation.toRotationMatrix());
  return {euler.roll_rad * kDegrees, euler.pitch_rad * kDegrees, euler.yaw_rad * kDegrees};
}

Json RecoveriesOf(const EgomotionReport& report) {
  Json rows = Json::array();
  for (const Recovery& recovery : report.recoveries) {
    rows.push_back({{"time", recovery.time_s},
                    {"moved_m", recovery.moved_m},
                    {"turned_deg", recovery.turned_rad * kDegrees}});
  }
  return rows;
}

Json GapsOf(const EgomotionReport& report) {
  Json rows = Json::array();
  for (const FixGap& gap : report.gaps) {
    rows.push_back({{"begin", gap.begin_s}, {"seconds", gap.end_s - gap.begin_s}});
  }
  return rows;
}

}  // namespace

void WarnOf(const EgomotionReport& report, Output& output) {
  if (!report.recoveries.empty()) {
    output.Talk(absl::StrCat("warning: the state was wrong and moved to where fixes agree, ",
                             report.recoveries.size(),
                             " time(s); poses before each are off by as much as 'moved_m' says"));
  }
  if (2 * report.rejected > report.fixes) {
    output.Talk(
        "warning: more than half of the fixes were rejected; a wrong rig (--rig: antenna, "
        "lag, IMU's orientation) or σ that are too small look like that");
  }
}

Json ToJson(const Egomotion& egomotion) {
  const EgomotionReport& report = egomotion.report;
  const StateVector& sigma = report.last_sigma;
  const Eigen::Vector3d gyro_sigma = sigma.segment<3>(kGyroBias);
  const Eigen::Vector3d accelerometer_sigma = sigma.segment<3>(kAccelerometerBias);
  return {{"origin",
           {egomotion.origin.latitude_rad * kDegrees,
            egomotion.origin.longitude_rad * kDegrees,
            egomotion.origin.altitude_m}},
          {"seconds", report.duration_s},
          {"distance_m", report.distance_m},
          {"poses", egomotion.trajectory.poses().size()},
          {"fixes", report.fixes},
          {"fixes_used", report.used},
          {"fixes_rejected", report.rejected},
          {"recoveries", RecoveriesOf(report)},
          {"gaps", GapsOf(report)},
          {"innovation_rms_m", report.innovation_rms_m},
          {"mean_nis", report.mean_nis},
          {"stood_at_start", report.rested_at_start},
          {"heading_at_start_deg", report.heading_at_start_rad * kDegrees},
          {"imu_orientation_deg", AnglesOf(egomotion.R_body_imu)},
          {"imu_yaw_mount_deg", report.last.yaw_mount_rad * kDegrees},
          {"imu_yaw_mount_sigma_deg", sigma(kYawMount) * kDegrees},
          {"gyro_bias_deg_s", ToJson(Eigen::Vector3d(report.last.gyro_bias_rad_s * kDegrees))},
          {"gyro_bias_sigma_deg_s", ToJson(Eigen::Vector3d(gyro_sigma * kDegrees))},
          {"accelerometer_bias_m_s2", ToJson(report.last.accelerometer_bias_m_s2)},
          {"accelerometer_bias_sigma_m_s2", ToJson(accelerometer_sigma)},
          {"wheel_scale", 1.0 + report.last.wheel_scale},
          {"wheel_scale_sigma", sigma(kWheelScale)}};
}

}  // namespace strata::cli
