// A participant of DDS that to nodes of ROS 2 is one of them.
#ifndef STRATA_CLIENT_ROS2_NODE_H_
#define STRATA_CLIENT_ROS2_NODE_H_

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <dds/dds.h>

namespace strata::ros2 {

// What a reader asks for, or a writer offers. A reader hears only writers that offer as much.
struct RosQos {
  bool reliable = true;          // what is lost on the way is sent again
  bool transient_local = false;  // who comes later gets the last ones, too
  int depth = 10;                // of the last ones that are kept
};

// A message in CDR as it came; its bytes stay where the network put them.
struct CdrMessage {
  std::shared_ptr<const void> owner;
  absl::string_view bytes;
};

// Ends with what it stands for.
class Entity {
 public:
  explicit Entity(dds_entity_t handle = 0) : handle_(handle) {}
  ~Entity();
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }

  dds_entity_t handle() const { return handle_; }
  explicit operator bool() const { return handle_ > 0; }

 private:
  dds_entity_t handle_;
};

// Somebody who publishes.
struct Offer {
  std::string topic;  // "/points"; empty for what is none of ROS 2
  std::string type;   // "sensor_msgs/PointCloud2"
  bool reliable = false;
};

// Not thread-safe but for Write.
class Node {
 public:
  // `domain` as ROS_DOMAIN_ID, in [0, 232]. With the environment's ROS_LOCALHOST_ONLY=1 it talks to
  // this machine only; CYCLONEDDS_URI configures Cyclone DDS as with rmw_cyclonedds. UNAVAILABLE
  // where there is no network for it.
  static absl::StatusOr<std::unique_ptr<Node>> Create(int domain);

  // Messages of other participants. REQUIRES: DescriptorOf(type).
  absl::StatusOr<Entity> MakeReader(const std::string& topic,
                                    absl::string_view type,
                                    const RosQos& qos);
  absl::StatusOr<Entity> MakeWriter(const std::string& topic,
                                    absl::string_view type,
                                    const RosQos& qos);
  // What came since, at most `most`, the oldest first.
  static std::vector<CdrMessage> Take(const Entity& reader, std::size_t most);
  // `message` is of the type that idlc made of the writer's. Thread-safe.
  static absl::Status Write(const Entity& writer, const void* message);

  // Returns when a reader has something, or somebody begins or ends to publish.
  void Wait(absl::Duration longest) const;
  // Whether the offers are others now.
  bool UpdateOffers();
  std::vector<Offer> offers() const;

 private:
  using Guid = std::array<std::uint8_t, 16>;
  Node() = default;
  absl::StatusOr<Entity> MakeTopic(const std::string& topic, absl::string_view type);
  absl::Status Attach(const Entity& reader) const;

  Entity domain_;
  Entity participant_;
  Guid guid_{};
  Entity waitset_;
  Entity publications_;  // reader of the builtin topic
  std::map<Guid, Offer> offers_;
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_NODE_H_
