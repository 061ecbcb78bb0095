// A robot of ROS 2, played by Fast DDS, beside a real strata-ros2 and a real stratad.
#ifndef STRATA_TESTS_INTEGRATION_ROS2_FIXTURE_H_
#define STRATA_TESTS_INTEGRATION_ROS2_FIXTURE_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include <nlohmann/json.hpp>

#include "client/sdk/client.h"
#include "core/cloud/point_cloud.h"
#include "core/common/steady_time.h"
#include "core/geometry/pose.h"
#include "tests/integration/cli/cli_fixture.h"
#include "tests/support/ros2/fast_node.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {

inline constexpr std::int64_t kStartNs = 1'790'000'000'000'000'000;
inline constexpr std::int64_t kCloudEveryNs = 50'000'000;
inline constexpr double kSensorHeightM = 1.2;

bool WaitFor(const std::function<bool()>& condition);

// What the robot publishes, in order.
struct Published {
  std::int64_t stamp_ns = 0;
  bool cloud = false;
  std::string cdr;
};

struct RobotDrive {
  std::vector<Published> messages;
  std::size_t clouds = 0;
  std::vector<Pose> truth;     // T_world_lidar of each
  std::vector<Pose> odometry;  // T_odom_lidar of each
  std::string mounting;        // base_link -> lidar, on /tf_static
};

// A robot with a LiDAR in the world of the bridge, seen from `truth`, by an odometry that says so,
// from a moment on.
RobotDrive DriveThrough(const std::vector<Pose>& truth,
                        const std::vector<Pose>& T_odom_lidar,
                        std::int64_t start_ns = kStartNs);
// Over the bridge, a cloud every `step_m`, from its `first` on.
std::vector<Pose> WayOver(double step_m, std::size_t first = 0);
// The same with odometry of a wheeled robot's noise, which begins at T_world_odom.
RobotDrive DriveOver(double step_m,
                     std::size_t first = 0,
                     const Pose& T_world_odom = Pose::Identity());
// A drive's messages as a recording.
std::string BagOf(const RobotDrive& drive);

// A scan as the map has it.
struct Stored {
  Pose uploaded = Pose::Identity(), now = Pose::Identity();
  std::uint64_t sequence = 0;
  bool integrated = false;
  PointCloud points;
};

class Ros2Test : public CliTest {
 protected:
  Ros2Test();

  void Connect(const std::string& address);
  // With `more` arguments; keyframes go by way of Path("spool").
  void StartMapping(const std::string& address,
                    const std::vector<std::string>& more,
                    const std::string& map = "live");
  void StartBridge(const std::vector<std::string>& arguments);
  // What the bridge says of itself when it is asked to end.
  nlohmann::json EndBridge();

  std::map<std::int64_t, Stored> ScansOf(const std::string& map, bool points);
  // How many scans are in the map.
  std::size_t Integrated(const std::string& map);
  // Whether so many scans, all there are, are in the map, and none has come for two seconds.
  bool HasSettled(const std::string& map, std::size_t least);

  TestDomain domain_;
  FastNode robot_;
  std::unique_ptr<ChildProcess> bridge_;
  std::unique_ptr<api::Database> database_;

 private:
  std::size_t settling_ = 0;
  absl::Time settled_since_ = SteadyNow();
};

// Hears the last message of a topic.
class Ear {
 public:
  Ear(FastNode& node, const std::string& topic, const std::string& type, const FastQos& qos) {
    reader_ = node.Subscribe(topic, type, qos, [state = state_](const std::string& cdr) {
      const std::lock_guard lock(state->mutex);
      state->last = cdr;
      ++state->count;
    });
  }
  int writers() const { return reader_.writers(); }
  int count() const {
    const std::lock_guard lock(state_->mutex);
    return state_->count;
  }
  std::string last() const {
    const std::lock_guard lock(state_->mutex);
    return state_->last;
  }

 private:
  struct State {
    std::mutex mutex;
    std::string last;
    int count = 0;
  };
  std::shared_ptr<State> state_ = std::make_shared<State>();
  FastNode::Reader reader_;
};

// Plays drives and looks at what comes of them.
class Ros2DriveTest : public Ros2Test {
 protected:
  void SetUp() override;
  void AwaitReaders();
  // `at` is told how many clouds have been sent.
  void Play(const RobotDrive& drive, const std::function<void(std::size_t)>& at = nullptr);
  void WriteBag(const RobotDrive& drive, const std::string& name) const;
  // The number of its keyframes in the map "filed".
  std::size_t ImportAsFile(const RobotDrive& drive, const std::string& every);

  std::string address_;
  FastNode::Writer clouds_, odometry_, mounting_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_ROS2_FIXTURE_H_
