// A robot of ROS 2 that drives in a map which is there already: does map -> odom take it to where
// it is? The robot is played by Fast DDS, and its places are those that the simulator planted.
#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/steady_time.h"
#include "core/geometry/pose.h"
#include "tests/integration/ros2/ros2_fixture.h"
#include "tests/support/ros2/ros_cdr.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

// Of amcl and of this, "latched".
const FastQos kLatched = {.transient_local = true, .depth = 100};
constexpr std::int64_t kAheadNs = 200'000'000;  // of the robot's clock, by docs/ros2.md
// An odometry that is metres off after the bridge.
const OdometryNoise kDrifts = {.translation_sigma_m = 0.03, .rotation_sigma_rad = 0.004};
constexpr std::uint8_t kOk = 0, kError = 2;  // of diagnostic_msgs

// All that a robot hears of where it is.
class Heard {
 public:
  explicit Heard(FastNode& node) {
    transforms_ = node.Subscribe(
        "/tf", "tf2_msgs/TFMessage", {.depth = 1000}, [this](const std::string& cdr) {
          for (const CdrTransform& transform : ReadTransforms(cdr)) Add(transforms, transform);
        });
    poses_ =
        node.Subscribe("/amcl_pose",
                       "geometry_msgs/PoseWithCovarianceStamped",
                       kLatched,
                       [this](const std::string& cdr) { Add(poses, ReadPoseWithCovariance(cdr)); });
    diagnoses_ =
        node.Subscribe("/diagnostics",
                       "diagnostic_msgs/DiagnosticArray",
                       {.depth = 1000},
                       [this](const std::string& cdr) { Add(diagnoses, ReadDiagnosis(cdr)); });
  }

  template <typename T>
  std::vector<T> All(const std::vector<T>& list) const {
    const std::lock_guard lock(mutex_);
    return list;
  }
  template <typename T>
  std::size_t Count(const std::vector<T>& list) const {
    return All(list).size();
  }
  // The newest, once there is one.
  template <typename T>
  T Last(const std::vector<T>& list) const {
    const std::lock_guard lock(mutex_);
    return list.empty() ? T() : list.back();
  }
  bool Has(std::uint8_t level) const {
    const std::vector<CdrDiagnosis> all = All(diagnoses);
    return std::any_of(
        all.begin(), all.end(), [level](const CdrDiagnosis& one) { return one.level == level; });
  }

  std::vector<CdrTransform> transforms;
  std::vector<CdrPose> poses;
  std::vector<CdrDiagnosis> diagnoses;

 private:
  template <typename T>
  void Add(std::vector<T>& list, const T& one) {
    const std::lock_guard lock(mutex_);
    list.push_back(one);
  }

  mutable std::mutex mutex_;
  FastNode::Reader transforms_, poses_, diagnoses_;
};

// Errors of what was said at some moments of a drive.
struct Errors {
  std::vector<double> metres, radians;

  void Add(const Pose& said, const Pose& truth) {
    const Pose off = truth.inverse() * said;
    metres.push_back(off.translation().norm());
    radians.push_back(RotationAngleRad(off));
  }
  static double Quantile(std::vector<double> values, double share) {
    if (values.empty()) return INFINITY;
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  }
};

Pose Shifted(double x_m, double y_m, double heading_rad) {
  return MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ())),
                  {x_m, y_m, 0.0});
}

class Ros2TrackingTest : public Ros2DriveTest {
 protected:
  // The known map: where the bridge was driven over, at its planted poses.
  void SetUp() override {
    Ros2DriveTest::SetUp();
    MapBridge(Pose::Identity(), "mapper");
  }

  // As if the bridge stood at T_map_world.
  void MapBridge(const Pose& T_map_world, const std::string& trajectory) {
    std::vector<Pose> poses = WayOver(1.0);
    const std::vector<Pose> truth = poses;
    for (Pose& pose : poses) pose = T_map_world * pose;
    WriteBag(DriveThrough(truth, poses), "known.mcap");
    Json({"scan",
          "import",
          "filed",
          Path("known.mcap"),
          "--trajectory",
          trajectory,
          "--every",
          "0m",
          "--align",
          "off",
          "--wait"});
  }

  // Odometry that drifts, of a robot that is somewhere: its first pose is no place of the map.
  static std::vector<Pose> Drifting(const std::vector<Pose>& truth, std::uint64_t seed) {
    std::vector<Pose> odometry = NoisyOdometry(truth, kDrifts, seed);
    const Pose T_odom_world = Shifted(3.0, -8.0, 0.7) * truth.front().inverse();
    for (Pose& pose : odometry) pose = T_odom_world * pose;
    return odometry;
  }

  void StartLocalizing(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"filed", "--server", address_, "--localize-only"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    StartBridge(arguments);
  }
  // Told to a metre or two where its odometry begins.
  void StartLocalizing(const RobotDrive& drive) {
    const Pose T_map_odom =
        drive.truth.front() * Shifted(1.0, -1.0, 0.1) * drive.odometry.front().inverse();
    const Eigen::Vector3d p = T_map_odom.translation();
    const Eigen::Vector3d x = T_map_odom.rotation().col(0);
    StartLocalizing(
        {"--start", absl::StrCat(p.x(), ",", p.y(), ",", p.z(), ",", std::atan2(x.y(), x.x()))});
  }

  static void AwaitTransform(const Heard& heard) {
    ASSERT_TRUE(WaitFor([&] { return heard.Count(heard.transforms) > 0; }));
  }

  // Of /amcl_pose, each at its cloud's stamp.
  static Errors ErrorsOfPoses(const RobotDrive& drive, const std::vector<CdrPose>& poses) {
    Errors errors;
    for (const CdrPose& pose : poses) {
      const std::int64_t k = (pose.header.stamp_ns - kStartNs) / kCloudEveryNs;
      const Pose T_lidar_base =
          MakePose(Eigen::Quaterniond::Identity(), {0.0, 0.0, -kSensorHeightM});
      errors.Add(pose.pose, drive.truth.at(static_cast<std::size_t>(k)) * T_lidar_base);
    }
    return errors;
  }

  // Of map -> odom times the odometry of the newest cloud when it was said, from the first cloud
  // `from` on.
  static Errors ErrorsOfTransforms(const RobotDrive& drive,
                                   const std::vector<CdrTransform>& transforms,
                                   std::size_t from) {
    Errors errors;
    for (const CdrTransform& transform : transforms) {
      const std::int64_t k = (transform.header.stamp_ns - kAheadNs - kStartNs) / kCloudEveryNs;
      if (k < static_cast<std::int64_t>(from)) continue;
      const std::size_t cloud = std::min(static_cast<std::size_t>(k), drive.clouds - 1);
      errors.Add(transform.pose * drive.odometry[cloud], drive.truth[cloud]);
    }
    return errors;
  }
};

TEST_F(Ros2TrackingTest, MapToOdomTakesADriftingOdometryToWhereTheRobotIs) {
  const std::vector<Pose> truth = WayOver(0.8, 5);
  const RobotDrive drive = DriveThrough(truth, Drifting(truth, /*seed=*/3));
  StartLocalizing(drive);
  Heard heard(robot_);
  AwaitReaders();
  constexpr std::size_t kFound = 4;
  Play(drive, [&](std::size_t sent) {
    if (sent == kFound) AwaitTransform(heard);
  });
  absl::SleepFor(absl::Milliseconds(500));
  const std::vector<CdrPose> poses = heard.All(heard.poses);
  EXPECT_GT(poses.size(), 10U);
  const Errors of_poses = ErrorsOfPoses(drive, poses);
  EXPECT_LT(Errors::Quantile(of_poses.metres, 1.0), 0.15);
  EXPECT_LT(Errors::Quantile(of_poses.radians, 1.0), 0.01);
  const std::vector<CdrTransform> transforms = heard.All(heard.transforms);
  EXPECT_EQ(transforms.front().header.frame, "map");
  EXPECT_EQ(transforms.front().child, "odom");
  const Errors of_transforms = ErrorsOfTransforms(drive, transforms, kFound);
  EXPECT_GT(of_transforms.metres.size(), drive.clouds / 2);
  EXPECT_LT(Errors::Quantile(of_transforms.metres, 0.9), 0.3);
  EXPECT_LT(Errors::Quantile(of_transforms.metres, 1.0), 0.6);
  // Otherwise that would be no feat.
  const Pose T_map_odom = transforms.front().pose;
  Errors by_odometry;
  by_odometry.Add(T_map_odom * drive.odometry.back(), drive.truth.back());
  EXPECT_GT(by_odometry.metres[0], 1.0);
  EXPECT_EQ(heard.Last(heard.diagnoses).level, kOk);
  const nlohmann::json summary = EndBridge();
  EXPECT_GT(summary["tracked"], 10);
  EXPECT_EQ(summary["lost"], 0);
  EXPECT_EQ(summary["kept"], 0);
  EXPECT_EQ(ScansOf("filed", false).size(), WayOver(1.0).size());  // nothing was uploaded
}

// Lifted at the end and put down where it was before; its odometry knows nothing of that. There one
// ramp looks as the other, until it is over the bridge.
TEST_F(Ros2TrackingTest, ARobotThatIsCarriedIsLostAndFoundAgain) {
  std::vector<Pose> truth = WayOver(1.0);
  truth.resize(45);
  const std::size_t carried = truth.size();
  std::vector<Pose> odometry = Drifting(truth, /*seed=*/4);
  const std::vector<Pose> again = WayOver(1.0, 2);
  const std::vector<Pose> noisy = NoisyOdometry(again, kDrifts, /*seed=*/5);
  for (std::size_t i = 0; i < again.size(); ++i) {
    truth.push_back(again[i]);
    odometry.push_back(odometry[carried - 1] * noisy.front().inverse() * noisy[i]);
  }
  const RobotDrive drive = DriveThrough(truth, odometry);
  StartLocalizing(drive);
  Heard heard(robot_);
  AwaitReaders();
  std::size_t before = 0;
  Play(drive, [&](std::size_t sent) {
    if (sent == 4) AwaitTransform(heard);
    if (sent == carried) {
      absl::SleepFor(absl::Milliseconds(500));
      before = heard.Count(heard.transforms) - 1;
    }
    if (sent > carried) absl::SleepFor(absl::Milliseconds(200));
  });
  EXPECT_TRUE(WaitFor([&] { return heard.Last(heard.diagnoses).level == kOk; }));
  absl::SleepFor(absl::Milliseconds(500));
  // Never anywhere else than where it is, or was as far as anybody knows.
  EXPECT_LT(Errors::Quantile(ErrorsOfPoses(drive, heard.All(heard.poses)).metres, 1.0), 0.2);
  const std::vector<CdrTransform> transforms = heard.All(heard.transforms);
  const Pose& T_stale = transforms[before].pose;
  for (std::size_t i = before; i < transforms.size(); ++i) {
    const Errors errors = ErrorsOfTransforms(drive, {transforms[i]}, 0);
    const double moved_m = (T_stale.inverse() * transforms[i].pose).translation().norm();
    EXPECT_LT(std::min(errors.metres[0], moved_m), 0.6) << i << " " << errors.metres[0];
  }
  const Errors at_end = ErrorsOfTransforms(drive, {transforms.back()}, 0);
  EXPECT_LT(at_end.metres[0], 0.3);
  EXPECT_LT(at_end.radians[0], 0.02);
  EXPECT_GT((T_stale.inverse() * transforms.back().pose).translation().norm(), 5.0);
  EXPECT_TRUE(heard.Has(kError));
  EXPECT_GT(EndBridge()["lost"], 0);
}

// Its odometry counts meanwhile.
TEST_F(Ros2TrackingTest, WhereTheServerIsAwayMapToOdomStaysAndGoesOnWithIt) {
  const std::vector<Pose> truth = WayOver(0.8, 5);
  const RobotDrive drive = DriveThrough(truth, Drifting(truth, /*seed=*/6));
  const std::size_t away = 20, back = 35;
  StartLocalizing(drive);
  Heard heard(robot_);
  AwaitReaders();
  std::size_t first_away = 0, last_away = 0;
  Play(drive, [&](std::size_t sent) {
    if (sent == 4) AwaitTransform(heard);
    if (sent == away) {
      server().Signal(SIGKILL);
      server().Wait();
      // What was on its way comes; on a busy machine late.
      Pose T_before = Pose::Identity();
      ASSERT_TRUE(WaitFor([&] {
        const Pose T_last = std::exchange(T_before, heard.Last(heard.transforms).pose);
        absl::SleepFor(absl::Milliseconds(500));
        return heard.Last(heard.transforms).pose.isApprox(T_last, 1e-12);
      }));
      first_away = heard.Count(heard.transforms);
    }
    if (sent == back) {
      ASSERT_TRUE(WaitFor([&] { return heard.Last(heard.diagnoses).level == kError; }));
      last_away = heard.Count(heard.transforms);
      StartServer();
      Connect(address_);
    }
    if (sent > back) absl::SleepFor(absl::Milliseconds(200));
  });
  EXPECT_TRUE(WaitFor([&] { return heard.Last(heard.diagnoses).level == kOk; }));
  absl::SleepFor(absl::Milliseconds(500));
  const std::vector<CdrTransform> transforms = heard.All(heard.transforms);
  EXPECT_GT(last_away, first_away + 10);  // said on
  for (std::size_t i = first_away; i < last_away; ++i) {
    EXPECT_TRUE(transforms[i].pose.isApprox(transforms[first_away].pose, 1e-12));
  }
  EXPECT_LT(Errors::Quantile(ErrorsOfPoses(drive, heard.All(heard.poses)).metres, 1.0), 0.2);
  EXPECT_LT(ErrorsOfTransforms(drive, {transforms.back()}, 0).metres[0], 0.3);
  EndBridge();
}

// Two bridges that are the same; one scan does not tell them apart, somebody does.
TEST_F(Ros2TrackingTest, ARobotAmongPlacesThatLookAlikeIsFoundWhereSomebodySaysThatItIs) {
  const Pose T_map_twin = Shifted(300.0, 40.0, 0.0);
  MapBridge(T_map_twin, "twin");
  const std::vector<Pose> truth = WayOver(1.0, 5);
  const RobotDrive drive = DriveThrough(truth, Drifting(truth, /*seed=*/7));
  StartLocalizing();
  Heard heard(robot_);
  auto guesses = robot_.Advertise("/initialpose", "geometry_msgs/PoseWithCovarianceStamped", {});
  AwaitReaders();
  Play(drive, [&](std::size_t sent) {
    if (sent != 10) return;
    ASSERT_TRUE(WaitFor([&] { return guesses.readers() == 1 && heard.Has(kError); }));
    EXPECT_EQ(heard.Count(heard.transforms), 0U);
    const Pose roughly = T_map_twin * drive.truth[9] * Shifted(1.0, -1.5, 0.2);
    ASSERT_TRUE(guesses.Write(InitialPoseCdr({0, "map"}, roughly)));
  });
  AwaitTransform(heard);
  absl::SleepFor(absl::Milliseconds(500));
  Errors at_end;
  at_end.Add(heard.Last(heard.transforms).pose * drive.odometry.back(),
             T_map_twin * drive.truth.back());
  EXPECT_LT(at_end.metres[0], 0.3);
  EndBridge();
}

// A robot that maps is tracked in what it has mapped, and uploads all the same.
TEST_F(Ros2TrackingTest, ARobotThatMapsIsTrackedInItsOwnMap) {
  const RobotDrive drive = DriveOver(0.8);
  StartMapping(address_, {"--every", "1.5m"});
  Heard heard(robot_);
  AwaitReaders();
  // No faster than its map grows on a busy machine, beyond which there is nothing to be tracked in,
  // and with time to be tracked there: of the clouds that come meanwhile only the newest is looked
  // at.
  std::size_t poses_before = 0;
  Play(drive, [&](std::size_t sent) {
    if (sent % 4 != 0) return;
    ASSERT_TRUE(WaitFor([&] { return Integrated("live") >= sent / 4; }));
    const absl::Time until = SteadyNow() + absl::Seconds(3);
    while (heard.Count(heard.poses) == poses_before && SteadyNow() < until) {
      absl::SleepFor(absl::Milliseconds(50));
    }
    poses_before = heard.Count(heard.poses);
  });
  EXPECT_TRUE(WaitFor([&] { return heard.Has(kOk); }));
  absl::SleepFor(absl::Milliseconds(500));
  EXPECT_FALSE(heard.Has(kError));
  const Errors of_poses = ErrorsOfPoses(drive, heard.All(heard.poses));
  EXPECT_GT(of_poses.metres.size(), 4U);
  // The map itself is some centimetres off its first scan.
  EXPECT_LT(Errors::Quantile(of_poses.metres, 1.0), 0.4);
  const nlohmann::json summary = EndBridge();
  EXPECT_GT(summary["kept"], drive.clouds / 4);
  EXPECT_GT(summary["tracked"], 4);
}

}  // namespace
}  // namespace strata::testing
