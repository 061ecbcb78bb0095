// One piece of work beside its caller's.
#ifndef STRATA_CORE_ENGINE_MAP_ASIDE_H_
#define STRATA_CORE_ENGINE_MAP_ASIDE_H_

#include <functional>
#include <thread>

#include "absl/status/status.h"

namespace strata {

// Everything that `work` refers to must outlive this.
class Aside {
 public:
  // Begins `work` on a thread of its own, called `name`; where the system has none to give, it is
  // done by Await().
  Aside(const char* name, std::function<absl::Status()> work);
  // Waits; what was not begun is not done.
  ~Aside();
  Aside(const Aside&) = delete;
  Aside& operator=(const Aside&) = delete;

  // What `work` returned; RESOURCE_EXHAUSTED for an allocation that failed. Safe to call again.
  absl::Status Await();

 private:
  std::function<absl::Status()> work_;  // empty once it is done
  absl::Status status_;
  std::thread thread_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_ASIDE_H_
