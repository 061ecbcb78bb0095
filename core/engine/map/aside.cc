#include "core/engine/map/aside.h"

#include <functional>
#include <system_error>
#include <utility>

#include "absl/status/status.h"

#include "core/common/guarded.h"
#include "core/common/this_thread.h"

namespace strata {

Aside::Aside(const char* name, std::function<absl::Status()> work) : work_(std::move(work)) {
  try {
    thread_ = std::thread([this, name] {
      NameThisThread(name);
      status_ = Guarded(work_);
    });
  } catch (const std::system_error&) {
    // Await() does it.
  }
}

Aside::~Aside() {
  if (thread_.joinable()) thread_.join();
}

absl::Status Aside::Await() {
  if (work_ == nullptr) return status_;
  if (thread_.joinable()) {
    thread_.join();
  } else {
    status_ = Guarded(work_);
  }
  work_ = nullptr;
  return status_;
}

}  // namespace strata
