#include "core/egomotion/egomotion.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/common/status.h"
#include "core/egomotion/geodesy.h"
#include "core/egomotion/log_checks.h"
#include "core/egomotion/log_filter.h"
#include "core/egomotion/mounting.h"
#include "core/geometry/rotation_between.h"

namespace strata {
namespace {

constexpr double kRestS = 2.0;
constexpr double kRestSpeedM_s = 0.01;
constexpr double kRestRateRad_s = 0.01;  // standard deviation
constexpr double kRestForceM_s2 = 0.2;   // likewise
// Headings that are tried at the start, and how uncertain each is.
constexpr int kHeadings = 8;
constexpr double kHeadingSigmaRad = 0.4;
constexpr double kGivenHeadingSigmaRad = 0.1;
// The way and the fixes after which the most likely of them is taken.
constexpr double kStartWayM = 20.0;
constexpr std::size_t kStartFixes = 10;
constexpr double kFarthestOriginM = 1e5;
constexpr double kTellEveryS = 1.0;
constexpr int kRestarts = 5;
// They go on until the heading is so sure, or for so long.
constexpr double kSureHeadingRad = 0.1;
constexpr double kLongestStartM = 200.0;
constexpr double kSameHeadingRad = 0.02;
constexpr double kLevelSigmaRad = 0.1;

MapLog InMap(const MotionLog& log, const Rig& rig, const LocalFrame& frame) {
  MapLog result{log.imu, log.wheels, {}};
  for (WheelSample& sample : result.wheels) sample.time_s -= rig.wheels.lag_s;
  for (const GpsFix& fix : log.fixes) {
    result.fixes.push_back({fix.time_s - rig.gps.lag_s,
                            frame.ToMap({fix.latitude_rad, fix.longitude_rad, fix.altitude_m}),
                            fix.sigma_m});
  }
  return result;
}

// The first kRestS of a log.
struct Beginning {
  Eigen::Vector3d rate = Eigen::Vector3d::Zero(), force = Eigen::Vector3d::Zero();  // means
  bool rests = false;
};

Beginning BeginningOf(const MapLog& log) {
  Beginning result;
  Eigen::Vector3d rate2 = Eigen::Vector3d::Zero(), force2 = Eigen::Vector3d::Zero();
  const double until_s = log.imu.front().time_s + kRestS;
  double count = 0.0;
  for (const ImuSample& sample : log.imu) {
    if (sample.time_s > until_s) break;
    result.rate += sample.angular_rate_rad_s;
    result.force += sample.specific_force_m_s2;
    rate2 += sample.angular_rate_rad_s.cwiseAbs2();
    force2 += sample.specific_force_m_s2.cwiseAbs2();
    count += 1.0;
  }
  result.rate /= count;
  result.force /= count;
  const double rate_variance = (rate2 / count - result.rate.cwiseAbs2()).maxCoeff();
  const double force_variance = (force2 / count - result.force.cwiseAbs2()).maxCoeff();
  const bool moves =
      std::any_of(log.wheels.begin(), log.wheels.end(), [&](const WheelSample& sample) {
        return sample.time_s <= until_s && std::abs(sample.speed_m_s) > kRestSpeedM_s;
      });
  result.rests = !moves && rate_variance < kRestRateRad_s * kRestRateRad_s &&
                 force_variance < kRestForceM_s2 * kRestForceM_s2;
  return result;
}

FilterStart StartOf(const MapLog& log,
                    const Rig& rig,
                    const Beginning& beginning,
                    double heading_rad,
                    double heading_sigma_rad) {
  const MapFix& first = log.fixes.front();
  const double late_s = std::max(0.0, first.time_s - log.imu.front().time_s);
  const bool has_wheels = !log.wheels.empty();
  const double speed = has_wheels ? log.wheels.front().speed_m_s : 0.0;
  const double speed_sigma = has_wheels ? 0.3 : 10.0;
  FilterStart start;
  FusedState& state = start.state;
  state.time_s = log.imu.front().time_s;
  const Eigen::Vector3d up_body = *rig.R_body_imu * beginning.force;
  state.R_map_body = Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()) *
                     RotationBetween(up_body, Eigen::Vector3d::UnitZ());
  state.v_imu_m_s = speed * (state.R_map_body * Eigen::Vector3d::UnitX());
  state.p_imu_m = first.antenna_m - state.R_map_body * (rig.gps.antenna_body_m - rig.imu_body_m) -
                  late_s * state.v_imu_m_s;
  if (beginning.rests) state.gyro_bias_rad_s = beginning.rate;
  const Eigen::Vector3d level(kLevelSigmaRad, kLevelSigmaRad, heading_sigma_rad);
  StateVector sigma;
  // Close to level, so that the body's z is the map's.
  sigma << level,
      first.sigma_m.cwiseMax(rig.gps.least_sigma_m) +
          Eigen::Vector3d::Constant(late_s * (std::abs(speed) + speed_sigma)),
      Eigen::Vector3d::Constant(speed_sigma + std::abs(speed) * heading_sigma_rad),
      Eigen::Vector3d::Constant(beginning.rests ? 0.1 * rig.imu.gyro_bias_rad_s
                                                : rig.imu.gyro_bias_rad_s),
      Eigen::Vector3d::Constant(rig.imu.accelerometer_bias_m_s2), rig.wheels.scale,
      rig.yaw_mount_rad;
  start.covariance = sigma.cwiseAbs2().asDiagonal();
  return start;
}

bool HasStarted(const LogFilter& filter) {
  return filter.fixes().size() >= kStartFixes && filter.distance_m() >= kStartWayM;
}

// A fast car has gone 20 m in two seconds, of which a receiver's errors are one and the same.
bool KnowsHeading(const LogFilter& filter) {
  const double sigma_rad = std::sqrt(filter.filter().Covariance()(kRotation + 2, kRotation + 2));
  return sigma_rad < kSureHeadingRad || filter.distance_m() >= kLongestStartM;
}

// All headings side by side until the most likely is known.
absl::StatusOr<LogFilter> MostLikely(const MapLog& log,
                                     const Rig& rig,
                                     const Beginning& beginning,
                                     const EgomotionOptions& options,
                                     const Stop& stop) {
  std::vector<LogFilter> filters;
  const int count = options.heading_rad.has_value() ? 1 : kHeadings;
  for (int k = 0; k < count; ++k) {
    const double heading_rad = options.heading_rad.value_or(2.0 * std::numbers::pi * k / count);
    const double sigma_rad =
        options.heading_rad.has_value() ? kGivenHeadingSigmaRad : kHeadingSigmaRad;
    filters.emplace_back(log, rig, StartOf(log, rig, beginning, heading_rad, sigma_rad));
  }
  const auto best = [&]() -> LogFilter& {
    return *std::max_element(
        filters.begin(), filters.end(), [](const LogFilter& a, const LogFilter& b) {
          return a.log_likelihood() < b.log_likelihood();
        });
  };
  if (count > 1) {
    while (!best().done()) {
      STRATA_RETURN_IF_ERROR(stop.status());
      for (LogFilter& filter : filters) filter.Step();
      if (HasStarted(best())) break;
    }
  }
  return best();
}

// The filter is linear about its states, and those of the first metres are as far off as the
// heading that was tried: it begins again with what it found, until that stays.
absl::StatusOr<LogFilter> Begin(const MapLog& log,
                                const Rig& rig,
                                const Beginning& beginning,
                                const EgomotionOptions& options,
                                const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(LogFilter filter, MostLikely(log, rig, beginning, options, stop));
  double heading_rad = filter.HeadingAtStart();
  for (int i = 0; i < kRestarts && !options.heading_rad.has_value(); ++i) {
    LogFilter again(log, rig, StartOf(log, rig, beginning, heading_rad, kHeadingSigmaRad));
    while (!again.done() && !HasStarted(again)) {
      STRATA_RETURN_IF_ERROR(stop.status());
      again.Step();
    }
    again.Settle();
    while (!again.done() && !KnowsHeading(again)) {
      STRATA_RETURN_IF_ERROR(stop.status());
      again.Step();
    }
    const double change_rad = again.HeadingAtStart() - heading_rad;
    filter = again;
    heading_rad = filter.HeadingAtStart();
    if (std::abs(std::remainder(change_rad, 2.0 * std::numbers::pi)) < kSameHeadingRad) break;
  }
  filter.Settle();
  return filter;
}

absl::StatusOr<GeodeticOrigin> OriginOf(const MotionLog& log, const EgomotionOptions& options) {
  const GpsFix& fix = log.fixes.front();
  const GeodeticOrigin first{fix.latitude_rad, fix.longitude_rad, fix.altitude_m};
  if (!options.origin.has_value()) return first;
  const double away_m = LocalFrame(*options.origin).ToMap(first).norm();
  if (away_m <= kFarthestOriginM) return *options.origin;
  return absl::InvalidArgumentError(absl::StrFormat(
      "the first fix is %.0f km from the map's origin, at most %.0f km are mapped with it",
      away_m / 1000.0,
      kFarthestOriginM / 1000.0));
}

std::vector<FixGap> GapsOf(const std::vector<FixOutcome>& fixes, double begin_s, double end_s) {
  std::vector<FixGap> gaps;
  double last_s = begin_s;
  const auto close = [&](double time_s) {
    if (time_s - last_s > kFixGapS) gaps.push_back({last_s, time_s});
    last_s = time_s;
  };
  for (const FixOutcome& fix : fixes) {
    if (fix.used) close(fix.time_s);
  }
  close(end_s);
  return gaps;
}

EgomotionReport ReportOf(const LogFilter& run, const Beginning& beginning) {
  EgomotionReport report;
  report.fixes = run.fixes().size();
  double squares = 0.0, nis = 0.0;
  for (const FixOutcome& fix : run.fixes()) {
    if (!fix.used) {
      ++report.rejected;
      continue;
    }
    ++report.used;
    squares += fix.innovation_m.head<2>().squaredNorm();
    nis += fix.horizontal_nis;
  }
  const double used = std::max<double>(1.0, static_cast<double>(report.used));
  report.innovation_rms_m = std::sqrt(squares / used);
  report.mean_nis = nis / used;
  report.recoveries = run.recoveries();
  report.gaps = GapsOf(run.fixes(), run.poses().front().time_s, run.poses().back().time_s);
  report.duration_s = run.poses().back().time_s - run.poses().front().time_s;
  report.distance_m = run.distance_m();
  report.rested_at_start = beginning.rests;
  const Eigen::Matrix3d R = run.poses().front().T_map_body.linear();
  report.heading_at_start_rad = std::atan2(R(1, 0), R(0, 0));
  report.last = run.filter().state();
  report.last_sigma = run.filter().Covariance().diagonal().cwiseSqrt();
  return report;
}

}  // namespace

absl::StatusOr<Egomotion> FilterLog(const MotionLog& log,
                                    const Rig& rig,
                                    const EgomotionOptions& options,
                                    const Stop& stop) {
  STRATA_RETURN_IF_ERROR(ValidateRig(rig));
  STRATA_RETURN_IF_ERROR(ValidateLog(log));
  Rig mounted = rig;
  if (!mounted.R_body_imu.has_value()) {
    STRATA_ASSIGN_OR_RETURN(mounted.R_body_imu, FindMounting(log, rig));
  }
  STRATA_ASSIGN_OR_RETURN(const GeodeticOrigin origin, OriginOf(log, options));
  const MapLog map_log = InMap(log, mounted, LocalFrame(origin));
  const Beginning beginning = BeginningOf(map_log);
  STRATA_ASSIGN_OR_RETURN(LogFilter run, Begin(map_log, mounted, beginning, options, stop));
  const double end_s = map_log.imu.back().time_s;
  double told_s = -std::numeric_limits<double>::infinity();
  while (!run.done()) {
    STRATA_RETURN_IF_ERROR(stop.status());
    if (options.told && run.time_s() >= told_s + kTellEveryS) {
      STRATA_RETURN_IF_ERROR(options.told({run.poses(), run.fixes(), end_s}));
      told_s = run.time_s();
    }
    run.Step();
  }
  run.Record(true);
  if (options.told) STRATA_RETURN_IF_ERROR(options.told({run.poses(), run.fixes(), end_s}));
  STRATA_ASSIGN_OR_RETURN(Trajectory trajectory, Trajectory::Make(run.poses()));
  return Egomotion{origin,
                   *mounted.R_body_imu,
                   std::move(trajectory),
                   run.states(),
                   run.fixes(),
                   ReportOf(run, beginning)};
}

}  // namespace strata
