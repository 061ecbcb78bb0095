// Whether the server can do its work now, which is another question than whether it lives.
#ifndef STRATA_SERVER_READINESS_H_
#define STRATA_SERVER_READINESS_H_

#include <functional>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace strata::server {

struct ReadinessCheck {
  std::string cause;                 // a word: "disk"
  std::function<std::string()> why;  // what is wrong, for people; empty: nothing
};

// Looks at all checks again and again, on a thread of its own. What changes is logged. Thread-safe.
class Readiness {
 public:
  // `tell` is called with whether nothing is wrong: at once, then at each change. The checks are
  // called every `interval`, one after another, and should be quick.
  Readiness(std::vector<ReadinessCheck> checks,
            absl::Duration interval,
            std::function<void(bool)> tell);
  ~Readiness();
  Readiness(const Readiness&) = delete;
  Readiness& operator=(const Readiness&) = delete;

  // Why not, by cause; of a cause that is well, empty.
  std::map<std::string, std::string> state() const;

 private:
  void Look();
  void Loop();

  const std::vector<ReadinessCheck> checks_;
  const absl::Duration interval_;
  const std::function<void(bool)> tell_;
  mutable absl::Mutex mutex_;
  std::map<std::string, std::string> state_ ABSL_GUARDED_BY(mutex_);
  bool closing_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_READINESS_H_
