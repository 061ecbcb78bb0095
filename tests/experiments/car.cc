// Egomotion (thesis 10.2.1) on two recorded logs and a simulated one: exits 1 where a bound does
// not hold, 77 where recorded data are absent.
//
// Usage: car husky|dresden|simulated [seed]
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "client/formats/motion/recorded_log.h"
#include "core/egomotion/egomotion.h"
#include "core/egomotion/geodesy.h"
#include "core/egomotion/motion_log.h"
#include "core/egomotion/rig.h"
#include "core/egomotion/smoothing/smoother.h"
#include "core/egomotion/trajectory.h"
#include "tests/experiments/meshes/mesh_cases.h"
#include "tests/support/data_dir.h"
#include "tests/support/simulator/simulated_drive.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

constexpr int kNoData = 77;
constexpr double kEarthM = 6.37e6;
constexpr double kDegrees = 180.0 / std::numbers::pi;

Egomotion Filter(const MotionLog& log, const Rig& rig, const EgomotionOptions& options = {}) {
  return OrDie(FilterLog(log, rig, options));
}

void Print(const char* what, const Egomotion& run) {
  const EgomotionReport& report = run.report;
  std::printf(
      "%s: %.0f s, %.0f m, %zu of %zu fixes used, %zu recoveries, innovation RMS %.2f m, mean NIS "
      "%.2f\n  heading %.0f deg; gyro bias %.3f %.3f %.3f deg/s; accelerometer bias %.2f %.2f %.2f "
      "m/s2; wheels x %.3f; mount %+.1f deg\n",
      what,
      report.duration_s,
      report.distance_m,
      report.used,
      report.fixes,
      report.recoveries.size(),
      report.innovation_rms_m,
      report.mean_nis,
      report.heading_at_start_rad * kDegrees,
      report.last.gyro_bias_rad_s.x() * kDegrees,
      report.last.gyro_bias_rad_s.y() * kDegrees,
      report.last.gyro_bias_rad_s.z() * kDegrees,
      report.last.accelerometer_bias_m_s2.x(),
      report.last.accelerometer_bias_m_s2.y(),
      report.last.accelerometer_bias_m_s2.z(),
      1.0 + report.last.wheel_scale,
      report.last.yaw_mount_rad * kDegrees);
}

double Quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// ---- a stretch of the log without GPS ----

struct Cut {
  double begin_s = 0.0, end_s = 0.0;
  bool Holds(double time_s) const { return time_s >= begin_s && time_s < end_s; }
};

MotionLog Without(const MotionLog& log, const Cut& cut, bool wheels_too) {
  MotionLog result = log;
  std::erase_if(result.fixes, [&](const GpsFix& fix) { return cut.Holds(fix.time_s); });
  if (wheels_too) {
    std::erase_if(result.wheels, [&](const WheelSample& s) { return cut.Holds(s.time_s); });
  }
  return result;
}

// Horizontal, of where a run had the antenna against the fixes it was not given.
struct CutErrors {
  double at_end_m = 0.0;
  double rms_m = 0.0;
};

CutErrors ErrorsIn(const Cut& cut, const Egomotion& run, const Rig& rig, const Egomotion& whole) {
  CutErrors errors;
  double count = 0.0;
  for (const FixOutcome& fix : whole.fixes) {
    if (!cut.Holds(fix.time_s + rig.gps.lag_s)) continue;
    const Pose T = OrDie(run.trajectory.At(fix.time_s)).T_map_body;
    const Eigen::Vector3d off = T * rig.gps.antenna_body_m - fix.antenna_m;
    errors.at_end_m = off.head<2>().norm();
    errors.rms_m += off.head<2>().squaredNorm();
    count += 1.0;
  }
  errors.rms_m = std::sqrt(errors.rms_m / std::max(count, 1.0));
  return errors;
}

struct CutTable {
  std::vector<double> at_end_m, rms_m, smoothed_rms_m;
};

double Pooled(const std::vector<double>& rms) {
  double squares = 0.0;
  for (const double value : rms) squares += value * value;
  return std::sqrt(squares / static_cast<double>(rms.size()));
}

// `count` cuts that begin anywhere after the first `settle_s`.
CutTable Cuts(const RecordedLog& recorded,
              const Egomotion& whole,
              double seconds,
              double settle_s,
              int count,
              bool wheels_too,
              Random& random) {
  const Rig& rig = recorded.rig;
  const double first_s = recorded.log.fixes.front().time_s + settle_s;
  const double last_s = recorded.log.fixes.back().time_s - seconds;
  CutTable table;
  for (int i = 0; i < count; ++i) {
    Cut cut;
    cut.begin_s = random.Uniform(first_s, last_s);
    cut.end_s = cut.begin_s + seconds;
    const MotionLog log = Without(recorded.log, cut, wheels_too);
    const Egomotion filtered = Filter(log, rig);
    const CutErrors filter = ErrorsIn(cut, filtered, rig, whole);
    table.at_end_m.push_back(filter.at_end_m);
    table.rms_m.push_back(filter.rms_m);
    const Egomotion smooth = OrDie(SmoothLog(log, rig, filtered));
    table.smoothed_rms_m.push_back(ErrorsIn(cut, smooth, rig, whole).rms_m);
  }
  std::printf(
      "| %2.0f s without GPS%s | %d cuts | at the end: median %.2f m, worst %.2f m | inside: RMS "
      "%.2f m, smoothed %.2f m |\n",
      seconds,
      wheels_too ? " and speed" : "",
      count,
      Quantile(table.at_end_m, 0.5),
      Quantile(table.at_end_m, 1.0),
      Pooled(table.rms_m),
      Pooled(table.smoothed_rms_m));
  return table;
}

void ExpectSmoother(const CutTable& cuts, const std::string& what) {
  Expect(Pooled(cuts.smoothed_rms_m) <= 0.8 * Pooled(cuts.rms_m),
         what + ": smoothed 20 % better inside");
}

// ---- fixes that jump ----

struct Planted {
  std::size_t planted = 0, rejected = 0, good = 0, good_rejected = 0;
};

Planted PlantJumps(const RecordedLog& recorded, double jump_m, std::size_t every, Random& random) {
  MotionLog log = recorded.log;
  std::vector<bool> bad(log.fixes.size(), false);
  const std::size_t first = 30 + static_cast<std::size_t>(random.Uniform(0.0, 10.0));
  for (std::size_t i = first; i < log.fixes.size(); i += every) {
    const double direction = random.Uniform(0.0, 2.0 * std::numbers::pi);
    GpsFix& fix = log.fixes[i];
    fix.latitude_rad += jump_m * std::sin(direction) / kEarthM;
    fix.longitude_rad += jump_m * std::cos(direction) / (kEarthM * std::cos(fix.latitude_rad));
    bad[i] = true;
  }
  const Egomotion run = Filter(log, recorded.rig);
  Planted result;
  const std::size_t skipped = log.fixes.size() - run.fixes.size();  // before the IMU began
  for (std::size_t i = 0; i < run.fixes.size(); ++i) {
    const bool planted = bad[i + skipped];
    (planted ? result.planted : result.good) += 1;
    if (!run.fixes[i].used) (planted ? result.rejected : result.good_rejected) += 1;
  }
  std::printf("%zu fixes moved by %.0f m: %zu rejected; of %zu others %zu\n",
              result.planted,
              jump_m,
              result.rejected,
              result.good,
              result.good_rejected);
  return result;
}

// ---- the two logs ----

int Husky(std::uint64_t seed) {
  const auto folder = FindData("husky_gps_imu_odom");
  if (!folder.has_value()) return kNoData;
  const RecordedLog recorded = OrDie(ReadRecordedLog(*folder));
  const Egomotion whole = Filter(recorded.log, recorded.rig);
  Print("husky", whole);
  Print("husky, smoothed", OrDie(SmoothLog(recorded.log, recorded.rig, whole)));
  Expect(whole.report.innovation_rms_m <= 0.95, "innovation RMS at most 0.95 m");
  Expect(whole.report.used >= 0.95 * whole.report.fixes, "95 % of the fixes are used");
  Random random(seed);
  const CutTable cuts15 = Cuts(recorded, whole, 15.0, 60.0, 15, false, random);
  const CutTable cuts30 = Cuts(recorded, whole, 30.0, 60.0, 15, false, random);
  const CutTable cuts60 = Cuts(recorded, whole, 60.0, 60.0, 15, false, random);
  Expect(Quantile(cuts15.at_end_m, 0.5) <= 2.1, "15 s: median at most 2.1 m");
  Expect(Quantile(cuts15.at_end_m, 1.0) <= 5.2, "15 s: worst at most 5.2 m");
  Expect(Quantile(cuts30.at_end_m, 0.5) <= 2.6, "30 s: median at most 2.6 m");
  Expect(Quantile(cuts30.at_end_m, 1.0) <= 5.4, "30 s: worst at most 5.4 m");
  Expect(Quantile(cuts60.at_end_m, 0.5) <= 4.6, "60 s: median at most 4.6 m");
  ExpectSmoother(cuts15, "15 s");
  ExpectSmoother(cuts30, "30 s");
  ExpectSmoother(cuts60, "60 s");
  const Planted planted = PlantJumps(recorded, 15.0, 13, random);
  Expect(planted.rejected == planted.planted, "every fix that jumps is rejected");
  // The receiver itself is off for ten seconds, with or without jumps.
  Expect(planted.good_rejected <= whole.report.rejected + 0.02 * planted.good,
         "at most 2 % more of the others are");
  EgomotionOptions wrong;
  wrong.heading_rad = whole.report.heading_at_start_rad + 2.0;
  const Egomotion recovered = Filter(recorded.log, recorded.rig, wrong);
  Print("husky, 115 deg off at the start", recovered);
  Expect(
      !recovered.report.recoveries.empty() && recovered.report.used >= 0.9 * recovered.report.fixes,
      "a wrong heading locks out less than a tenth of the fixes");
  return failures;
}

int Dresden(std::uint64_t seed) {
  const auto folder = FindData("dresden_car_gps_imu");
  if (!folder.has_value()) return kNoData;
  const RecordedLog recorded = OrDie(ReadRecordedLog(*folder));
  const Egomotion whole = Filter(recorded.log, recorded.rig);
  Print("dresden", whole);
  Print("dresden, smoothed", OrDie(SmoothLog(recorded.log, recorded.rig, whole)));
  Expect(whole.report.mean_nis <= 2.3, "innovations are no larger than the receiver's error says");
  Random random(seed);
  const CutTable cuts = Cuts(recorded, whole, 20.0, 40.0, 15, false, random);
  Cuts(recorded, whole, 20.0, 40.0, 15, true, random);
  Expect(Quantile(cuts.at_end_m, 0.5) <= 8.0, "20 s: median at most 8 m");
  ExpectSmoother(cuts, "20 s");
  return failures;
}

// ---- a car whose way is known: five loops of 2.3 km on 300 × 250 m (thesis 10.3) ----

// Ellipses that begin and end at one gate, each inside the one before.
class NestedLoops {
 public:
  explicit NestedLoops(double speed_m_s) : speed_m_s_(speed_m_s) {
    places_.push_back(At(0.0));
    lengths_.push_back(0.0);
    for (int i = 1; i <= 5 * kSteps; ++i) {
      places_.push_back(At(i / double{kSteps}));
      lengths_.push_back(lengths_.back() + (places_[i] - places_[i - 1]).norm());
    }
  }
  double length_m() const { return lengths_.back(); }
  Eigen::Vector3d operator()(double driven_s) const {
    const double way_m = std::clamp(speed_m_s_ * driven_s, 0.0, length_m() - 1e-6);
    const auto after = std::upper_bound(lengths_.begin(), lengths_.end(), way_m);
    const auto k = static_cast<std::size_t>(after - lengths_.begin());
    const double share = (way_m - lengths_[k - 1]) / (lengths_[k] - lengths_[k - 1]);
    // By the parameter and not by the chord, which would have corners.
    Eigen::Vector3d place = At((static_cast<double>(k - 1) + share) / kSteps);
    if (speed_m_s_ * driven_s < 0.0) place.x() += speed_m_s_ * driven_s;
    if (speed_m_s_ * driven_s > length_m()) place.x() += speed_m_s_ * driven_s - length_m();
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
  double speed_m_s_;
  std::vector<Eigen::Vector3d> places_;
  std::vector<double> lengths_;
};

struct Urban {
  MotionLog log;
  std::vector<bool> bad;  // which fixes are off by more than 5 m
};

// No GPS in a garage and under two bridges; beside walls fixes jump by up to 30 m for one to four
// seconds, and one wall draws them away slowly.
Urban AmongWalls(const DriveOptions& options, std::uint64_t seed) {
  Urban urban;
  urban.log = SimulateDrive(options, seed);
  Random random(seed + 77);
  std::vector<GpsFix> fixes;
  double jump_until_s = 0.0;
  Eigen::Vector2d jump_m = Eigen::Vector2d::Zero();
  for (GpsFix fix : urban.log.fixes) {
    const double t = fix.time_s - options.begin_s;
    const bool hidden =
        (t > 110.0 && t < 150.0) || (t > 60.0 && t < 65.0) || (t > 200.0 && t < 206.0);
    if (hidden) continue;
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

// Root mean square and largest horizontal distance to the true way.
std::pair<double, double> ErrorsOfWay(const Egomotion& run, const DriveOptions& options) {
  const LocalFrame truth(options.origin), frame(run.origin);
  double squares = 0.0, worst = 0.0;
  for (const TrajectoryPose& pose : run.trajectory.poses()) {
    const Eigen::Vector3d at = truth.ToMap(frame.ToEarth(pose.T_map_body.translation()));
    const Eigen::Vector3d off = at - TrueBodyPose(options, pose.time_s).translation();
    squares += off.head<2>().squaredNorm();
    worst = std::max(worst, off.head<2>().norm());
  }
  return {std::sqrt(squares / static_cast<double>(run.trajectory.poses().size())), worst};
}

int Simulated(std::uint64_t seed) {
  constexpr double kSpeedM_s = 8.0;
  const NestedLoops loops(kSpeedM_s);
  DriveOptions options;
  options.way = [&loops](double driven_s) { return loops(driven_s); };
  options.seconds = options.rest_s + 2.0 + loops.length_m() / kSpeedM_s;
  options.fix_hz = 5.0;
  options.rig.R_body_imu = Eigen::Quaterniond::Identity();
  options.rig.imu.gyro_noise = 2e-3;
  options.rig.imu.accelerometer_noise = 0.03;
  const Urban urban = AmongWalls(options, seed);
  const Egomotion whole = Filter(urban.log, options.rig);
  Print("simulated car", whole);
  const Egomotion smooth = OrDie(SmoothLog(urban.log, options.rig, whole));
  const auto [rms_m, worst_m] = ErrorsOfWay(whole, options);
  const auto [smooth_rms_m, smooth_worst_m] = ErrorsOfWay(smooth, options);
  Planted planted;
  for (std::size_t i = 0; i < whole.fixes.size(); ++i) {
    const bool bad = urban.bad[i + urban.bad.size() - whole.fixes.size()];
    (bad ? planted.planted : planted.good) += 1;
    if (!whole.fixes[i].used) (bad ? planted.rejected : planted.good_rejected) += 1;
  }
  std::printf(
      "way of %.0f m: filter off by %.2f m RMS, %.2f m at worst; smoothed %.2f m and %.2f m\n"
      "%zu fixes off by 5 to 30 m: %zu rejected; of %zu others %zu\n",
      loops.length_m(),
      rms_m,
      worst_m,
      smooth_rms_m,
      smooth_worst_m,
      planted.planted,
      planted.rejected,
      planted.good,
      planted.good_rejected);
  Expect(planted.rejected >= 0.95 * planted.planted, "95 % of the bad fixes are rejected");
  Expect(planted.good_rejected <= 0.02 * planted.good, "at most 2 % of the good ones are");
  Expect(smooth_rms_m <= rms_m, "smoothed is no worse");
  return failures;
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "husky";
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const int result = what == "dresden"     ? strata::testing::Dresden(seed)
                     : what == "simulated" ? strata::testing::Simulated(seed)
                                           : strata::testing::Husky(seed);
  return result == strata::testing::kNoData ? result : (result > 0 ? 1 : 0);
}
