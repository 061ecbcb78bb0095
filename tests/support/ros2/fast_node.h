// A node of ROS 2 as its default middleware makes them: Fast DDS with the names of ROS 2, and CDR
// by eProsima's library. It shares nothing with strata-ros2.
#ifndef STRATA_TESTS_SUPPORT_ROS2_FAST_NODE_H_
#define STRATA_TESTS_SUPPORT_ROS2_FAST_NODE_H_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/time/time.h"

namespace strata::testing {

struct FastQos {
  bool reliable = true;
  bool transient_local = false;
  int depth = 10;
};

// On this machine's loopback only. Messages are bytes of CDR.
class FastNode {
 public:
  explicit FastNode(int domain);
  ~FastNode();
  FastNode(const FastNode&) = delete;
  FastNode& operator=(const FastNode&) = delete;

  class Writer {
   public:
    // False where it could not be sent within a second.
    bool Write(const std::string& cdr);
    int readers() const;

   private:
    friend class FastNode;
    struct State;
    std::shared_ptr<State> state_;
  };
  // "/points", "sensor_msgs/PointCloud2".
  Writer Advertise(const std::string& topic, const std::string& type, const FastQos& qos);
  class Reader {
   public:
    int writers() const;

   private:
    friend class FastNode;
    std::shared_ptr<std::atomic<int>> writers_;
  };
  // Each message on a thread of Fast DDS.
  Reader Subscribe(const std::string& topic,
                   const std::string& type,
                   const FastQos& qos,
                   std::function<void(const std::string& cdr)> heard);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// A domain that no other test on this machine has: for as long as it lives.
class TestDomain {
 public:
  TestDomain();
  ~TestDomain();
  TestDomain(const TestDomain&) = delete;
  TestDomain& operator=(const TestDomain&) = delete;

  int number() const { return number_; }

 private:
  int number_ = 0;
  int socket_ = -1;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_ROS2_FAST_NODE_H_
