#include "client/ros2/listener.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"

namespace strata::ros2 {

bool Listener::Fits(const Offer& offer) const {
  return std::find(types_.begin(), types_.end(), offer.type) != types_.end();
}

absl::Status Listener::Follow(Node& node, const std::vector<Offer>& offers) {
  std::string type;
  bool reliable = true;
  for (const Offer& offer : offers) {
    if (offer.topic != topic_ || !Fits(offer)) continue;
    if (type.empty()) type = offer.type;
    reliable = reliable && offer.reliable;
  }
  // One that is gone may come back; what it sent is still to be read.
  if (type.empty() || (type == type_ && reliable == reliable_)) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(reader_,
                          node.MakeReader(topic_, type, {.reliable = reliable, .depth = depth_}));
  type_ = type;
  reliable_ = reliable;
  return absl::OkStatus();
}

std::string Listener::Missing(const std::vector<Offer>& offers, absl::string_view option) const {
  std::set<std::string> others;
  std::string wrong;
  for (const Offer& offer : offers) {
    if (offer.topic == topic_ && !Fits(offer)) wrong = offer.type;
    if (Fits(offer) && !offer.topic.empty()) others.insert(offer.topic);
  }
  std::string text =
      wrong.empty() ? absl::StrCat("nobody publishes ", topic_)
                    : absl::StrCat(topic_, " is a topic of ", wrong, ", not of ", types_.front());
  if (!others.empty()) {
    absl::StrAppend(&text,
                    "; ",
                    types_.front(),
                    " comes on ",
                    absl::StrJoin(others, ", "),
                    ": say ",
                    option,
                    " ",
                    *others.begin());
  } else if (wrong.empty()) {
    absl::StrAppend(&text,
                    "; ",
                    option,
                    " names another topic, and ROS_DOMAIN_ID or --domain the robot's domain");
  }
  return text;
}

}  // namespace strata::ros2
