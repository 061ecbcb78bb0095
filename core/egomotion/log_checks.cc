#include "core/egomotion/log_checks.h"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"

#include "core/common/status.h"

namespace strata {
namespace {

constexpr double kMaxSilenceS = 1.0;
constexpr double kMaxRateRad_s = 100.0;
constexpr double kMaxForceM_s2 = 1000.0;
constexpr double kMaxSpeedM_s = 1000.0;
constexpr double kMaxSigmaM = 1e6;

bool IsSensible(const ImuSample& sample) {
  return sample.angular_rate_rad_s.norm() <= kMaxRateRad_s &&
         sample.specific_force_m_s2.norm() <= kMaxForceM_s2;
}

bool IsSensible(const WheelSample& sample) {
  return std::abs(sample.speed_m_s) <= kMaxSpeedM_s &&
         std::abs(sample.yaw_rate_rad_s.value_or(0.0)) <= kMaxRateRad_s;
}

bool IsSensible(const GpsFix& fix) {
  return std::abs(fix.latitude_rad) <= 0.5 * std::numbers::pi &&
         std::abs(fix.longitude_rad) <= 2.0 * std::numbers::pi && std::isfinite(fix.altitude_m) &&
         fix.sigma_m.minCoeff() >= 0.0 && fix.sigma_m.maxCoeff() <= kMaxSigmaM;
}

template <typename Sample>
absl::Status ValidateSamples(const std::vector<Sample>& samples, const char* sensor) {
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!std::isfinite(samples[i].time_s) || !IsSensible(samples[i])) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "%s: sample %d holds a number that cannot be; remove it from the log", sensor, i));
    }
    if (i > 0 && samples[i].time_s <= samples[i - 1].time_s) {
      return absl::InvalidArgumentError(
          absl::StrFormat("%s: sample %d at %.6f s is not later than the one before; sort the log "
                          "by time",
                          sensor,
                          i,
                          samples[i].time_s));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ValidateLog(const MotionLog& log) {
  if (log.imu.size() < 2) return absl::InvalidArgumentError("IMU: the log has no two samples");
  if (log.fixes.empty()) {
    return absl::InvalidArgumentError("GPS: the log has no fix; without one nobody knows where");
  }
  STRATA_RETURN_IF_ERROR(ValidateSamples(log.imu, "IMU"));
  STRATA_RETURN_IF_ERROR(ValidateSamples(log.wheels, "wheels"));
  STRATA_RETURN_IF_ERROR(ValidateSamples(log.fixes, "GPS"));
  for (std::size_t i = 1; i < log.imu.size(); ++i) {
    const double silence_s = log.imu[i].time_s - log.imu[i - 1].time_s;
    if (silence_s <= kMaxSilenceS) continue;
    return absl::InvalidArgumentError(
        absl::StrFormat("IMU: silent for %.3f s from %.6f s on, more than %.0f s; split the log "
                        "there",
                        silence_s,
                        log.imu[i - 1].time_s,
                        kMaxSilenceS));
  }
  return absl::OkStatus();
}

}  // namespace strata
