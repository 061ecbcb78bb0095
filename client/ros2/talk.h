// What a program that runs for days tells people: a line where something is new.
#ifndef STRATA_CLIENT_ROS2_TALK_H_
#define STRATA_CLIENT_ROS2_TALK_H_

#include <iosfwd>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace strata::ros2 {

// Thread-safe.
class Talk {
 public:
  explicit Talk(std::ostream& out) : out_(out) {}

  void Say(const std::string& line);
  // Says how something stands, unless it was said last. An empty line is not said.
  void SayNew(const std::string& about, const std::string& line);
  // The same, for what is otherwise every time: at most every ten seconds.
  void SaySeldom(const std::string& about, const std::string& line);

 private:
  absl::Mutex mutex_;
  std::ostream& out_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::string> said_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, absl::Time> when_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata::ros2

#endif  // STRATA_CLIENT_ROS2_TALK_H_
