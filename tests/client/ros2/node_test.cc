// Nodes of another vendor beside ours: who hears whom.
#include "client/ros2/node.h"

#include <atomic>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>

#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/bags/ros_messages.h"
#include "client/ros2/listener.h"
#include "client/ros2/messages.h"
#include "core/common/steady_time.h"
#include "tests/support/patience.h"
#include "tests/support/ros2/fast_node.h"
#include "tests/support/ros2/ros_cdr.h"
#include "tests/support/status_matchers.h"

namespace strata::ros2 {
namespace {

using testing::FastNode;
using testing::IsOk;
using testing::TestDomain;

class NodeTest : public ::testing::Test {
 protected:
  NodeTest() {
    setenv("ROS_LOCALHOST_ONLY", "1", 1);
    domain_ = std::make_unique<TestDomain>();
    auto node = Node::Create(domain_->number());
    EXPECT_THAT(node, IsOk());
    node_ = *std::move(node);
    robot_ = std::make_unique<FastNode>(domain_->number());
  }

  // Follows who publishes until it is so.
  bool Until(const std::function<bool()>& condition) {
    const absl::Time end = SteadyNow() + testing::kPatience;
    while (!condition()) {
      if (SteadyNow() > end) return false;
      node_->Wait(absl::Milliseconds(20));
      if (!node_->UpdateOffers()) continue;
      EXPECT_THAT(poses_.Follow(*node_, node_->offers()), IsOk());
    }
    return true;
  }
  // The stamp of a pose that comes.
  std::int64_t Next(FastNode::Writer& writer, std::int64_t stamp_ns) {
    const std::string pose = testing::PoseCdr({stamp_ns, "map"}, Pose::Identity());
    std::int64_t heard_ns = 0;
    EXPECT_TRUE(Until([&] {
      writer.Write(pose);
      for (const CdrMessage& message : poses_.Take(10)) {
        heard_ns = ReadRosPoses(poses_.topic(), message.bytes)->front().header.stamp_ns;
      }
      return heard_ns != 0;
    }));
    return heard_ns;
  }

  std::unique_ptr<TestDomain> domain_;
  std::unique_ptr<Node> node_;
  std::unique_ptr<FastNode> robot_;
  Listener poses_{"/pose", {"nav_msgs/Odometry", "geometry_msgs/PoseStamped"}, 10};
};

TEST_F(NodeTest, WhatIsPublishedReliablyIsHeardReliably) {
  auto writer = robot_->Advertise("/pose", "geometry_msgs/PoseStamped", {.reliable = true});
  EXPECT_EQ(Next(writer, 123'000'000'456), 123'000'000'456);
  EXPECT_TRUE(poses_.reliable());
  EXPECT_EQ(poses_.topic().type, "geometry_msgs/PoseStamped");
}

// A reader that asked for reliability would hear nothing of these.
TEST_F(NodeTest, ABestEffortPublisherIsHeardAsSoonAsItIsThere) {
  auto reliable = robot_->Advertise("/pose", "geometry_msgs/PoseStamped", {.reliable = true});
  Next(reliable, 1);
  FastNode driver(domain_->number());
  auto best_effort = driver.Advertise("/pose", "geometry_msgs/PoseStamped", {.reliable = false});
  ASSERT_TRUE(Until([&] { return !poses_.reliable(); }));
  ASSERT_TRUE(Until([&] { return best_effort.readers() == 1; }));
  poses_.Take(1000);
  EXPECT_EQ(Next(best_effort, 2), 2);
}

TEST_F(NodeTest, WhoPublishesIsKnownByNameAndType) {
  const auto writer = robot_->Advertise("/ouster/points", "sensor_msgs/PointCloud2", {});
  EXPECT_TRUE(Until([&] {
    for (const Offer& offer : node_->offers()) {
      if (offer.topic == "/ouster/points") {
        return offer.type == "sensor_msgs/PointCloud2" && offer.reliable;
      }
    }
    return false;
  }));
}

// As RViz, which comes after the map.
TEST_F(NodeTest, WhatIsLatchedComesToWhoeverJoinsLate) {
  const auto writer = node_->MakeWriter(
      "/map", "nav_msgs/OccupancyGrid", {.reliable = true, .transient_local = true, .depth = 1});
  ASSERT_THAT(writer, IsOk());
  OccupancyGrid grid;
  grid.width = 3;
  grid.height = 2;
  grid.resolution_m = 0.5;
  grid.x_m = -1.0;
  grid.y_m = 2.0;
  grid.cells.assign(6, GridCell::kFree);
  grid.cells[4] = GridCell::kOccupied;
  ASSERT_THAT(WriteGrid(*writer, {"map", 5'000'000'006}, grid, 3.25), IsOk());
  absl::Mutex mutex;
  std::string heard;
  const auto reader = robot_->Subscribe(
      "/map", "nav_msgs/OccupancyGrid", {.transient_local = true}, [&](const std::string& cdr) {
        absl::MutexLock lock(&mutex);
        heard = cdr;
      });
  ASSERT_TRUE(Until([&] {
    absl::MutexLock lock(&mutex);
    return !heard.empty();
  }));
  absl::MutexLock lock(&mutex);
  const testing::CdrGrid seen = testing::ReadGrid(heard);
  EXPECT_EQ(seen.header.stamp_ns, 5'000'000'006);
  EXPECT_EQ(seen.header.frame, "map");
  EXPECT_FLOAT_EQ(seen.resolution_m, 0.5F);
  EXPECT_EQ(seen.width, 3U);
  EXPECT_EQ(seen.height, 2U);
  EXPECT_TRUE(seen.origin.translation().isApprox(Eigen::Vector3d(-1.0, 2.0, 3.25)));
  EXPECT_THAT(seen.data, ::testing::ElementsAre(0, 0, 0, 0, 100, 0));
}

TEST(NodeConfigurationTest, AConfigurationThatIsNoneIsSaid) {
  setenv("CYCLONEDDS_URI", "<General><Nonsense/></General>", 1);
  const TestDomain domain;
  const auto node = Node::Create(domain.number());
  unsetenv("CYCLONEDDS_URI");
  EXPECT_THAT(std::string(node.status().message()), ::testing::HasSubstr("CYCLONEDDS_URI"));
}

}  // namespace
}  // namespace strata::ros2
