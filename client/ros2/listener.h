// What a robot publishes, each topic with the reliability that its publishers offer.
#ifndef STRATA_CLIENT_ROS2_LISTENER_H_
#define STRATA_CLIENT_ROS2_LISTENER_H_

#include <cstddef>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"

#include "client/formats/bags/bag_reader.h"
#include "client/ros2/node.h"

namespace strata::ros2 {

// A topic that may be published reliably or not, by a type of several. A reader that asks for
// reliability hears no best-effort publisher, one that does not ask gets no second chance for what
// is lost; so it asks as soon as it knows who publishes, and again where others do.
class Listener {
 public:
  Listener(std::string topic, std::vector<std::string> types, int depth)
      : topic_(std::move(topic)), types_(std::move(types)), depth_(depth) {}

  // Looks at who publishes.
  absl::Status Follow(Node& node, const std::vector<Offer>& offers);
  std::vector<CdrMessage> Take(std::size_t most) const { return Node::Take(reader_, most); }
  // As its publishers have it; the type is empty before there is one.
  BagTopic topic() const { return {topic_, type_, MessageEncoding::kCdr}; }
  bool heard() const { return static_cast<bool>(reader_); }
  bool reliable() const { return reliable_; }

  // What to say while nobody publishes: the cure, where another topic has what is looked for.
  // `option` names topics on the command line.
  std::string Missing(const std::vector<Offer>& offers, absl::string_view option) const;

 private:
  bool Fits(const Offer& offer) const;

  std::string topic_;
  std::vector<std::string> types_;
  int depth_;
  std::string type_;
  bool reliable_ = false;
  Entity reader_;
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_LISTENER_H_
