#include "client/ros2/talk.h"

#include <ostream>
#include <string>

#include "absl/synchronization/mutex.h"

namespace strata::ros2 {

void Talk::Say(const std::string& line) {
  absl::MutexLock lock(&mutex_);
  out_ << line << std::endl;
}

void Talk::SayNew(const std::string& about, const std::string& line) {
  absl::MutexLock lock(&mutex_);
  std::string& said = said_[about];
  if (said == line) return;
  said = line;
  if (!line.empty()) out_ << line << std::endl;
}

}  // namespace strata::ros2
