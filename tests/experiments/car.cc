// Egomotion (thesis 10.2.1) on two recorded logs and a simulated one: exits 1 where a bound does
// not hold, 77 where recorded data are absent.
//
// Usage: car husky|dresden|simulated [seed]
//        car record FOLDER [seed] [metres between scans] [step_m]
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
#include "tests/experiments/simulated_car.h"
#include "tests/support/data_dir.h"
#include "tests/support/simulator/simulated_drive.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

constexpr int kNoData = 77;
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

// That bad fixes are rejected and good ones are not.
void ExpectFixes(const Urban& urban, const Egomotion& run) {
  Planted planted;
  for (std::size_t i = 0; i < run.fixes.size(); ++i) {
    const bool bad = urban.bad[i + urban.bad.size() - run.fixes.size()];
    (bad ? planted.planted : planted.good) += 1;
    if (!run.fixes[i].used) (bad ? planted.rejected : planted.good_rejected) += 1;
  }
  std::printf("%zu fixes off by 5 to 30 m: %zu rejected; of %zu others %zu\n",
              planted.planted,
              planted.rejected,
              planted.good,
              planted.good_rejected);
  Expect(planted.planted > 0 && planted.rejected >= 0.95 * planted.planted,
         "95 % of the bad fixes are rejected");
  Expect(planted.good_rejected <= 0.02 * planted.good, "at most 2 % of the good ones are");
}

int Simulated(std::uint64_t seed) {
  const DriveOptions options = CarDrive(false);
  const Urban urban = AmongWalls(options, seed);
  const Egomotion whole = Filter(urban.log, options.rig);
  Print("simulated car", whole);
  const Egomotion smooth = OrDie(SmoothLog(urban.log, options.rig, whole));
  const auto [rms_m, worst_m] = ErrorsOfWay(whole, options);
  const auto [smooth_rms_m, smooth_worst_m] = ErrorsOfWay(smooth, options);
  std::printf(
      "way of %.0f m: filter off by %.2f m RMS, %.2f m at worst; smoothed %.2f m and %.2f m\n",
      CarWayM(),
      rms_m,
      worst_m,
      smooth_rms_m,
      smooth_worst_m);
  ExpectFixes(urban, whole);
  Expect(smooth_rms_m <= rms_m, "smoothed is no worse");
  return failures;
}

// The same drive over hills as files, with scans: what car_maps.py makes maps of.
int Record(const std::string& folder, std::uint64_t seed, double step_m) {
  const DriveOptions options = CarDrive(true);
  const Urban urban = AmongWalls(options, seed);
  ExpectFixes(urban, Filter(urban.log, options.rig));
  const WrittenCar written = OrDie(WriteCar(options, urban, step_m, seed, folder));
  std::printf("%zu scans, %zu points in %s\n", written.scans, written.points, folder.c_str());
  return failures;
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "husky";
  const bool records = what == "record";
  if (records && argc < 3) {
    std::printf("car record FOLDER [seed] [metres between scans]\n");
    return 1;
  }
  const int at = records ? 3 : 2;
  const std::uint64_t seed = argc > at ? std::strtoull(argv[at], nullptr, 10) : 1;
  const double step_m = argc > at + 1 ? std::strtod(argv[at + 1], nullptr) : 4.0;
  const int result = records               ? strata::testing::Record(argv[2], seed, step_m)
                     : what == "dresden"   ? strata::testing::Dresden(seed)
                     : what == "simulated" ? strata::testing::Simulated(seed)
                                           : strata::testing::Husky(seed);
  return result == strata::testing::kNoData ? result : (result > 0 ? 1 : 0);
}
