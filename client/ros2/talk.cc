#include "client/ros2/talk.h"

#include <ostream>
#include <string>

#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/common/steady_time.h"

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

void Talk::SaySeldom(const std::string& about, const std::string& line) {
  constexpr absl::Duration kSeldom = absl::Seconds(10);
  {
    absl::MutexLock lock(&mutex_);
    const auto [when, is_first] = when_.try_emplace(about, SteadyNow());
    if (!is_first && SteadyNow() - when->second < kSeldom) return;
    when->second = SteadyNow();
  }
  SayNew(about, line);
}

}  // namespace strata::ros2
