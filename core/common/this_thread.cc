#include "core/common/this_thread.h"

#include <cstddef>
#include <string>

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

namespace strata {

void NameThisThread(const char* name) {
  constexpr std::size_t kMaxLength = 15;  // Linux refuses longer ones
  pthread_setname_np(pthread_self(), std::string(name).substr(0, kMaxLength).c_str());
}

void YieldThisThread(int steps) {
  // Linux keeps niceness for every thread. Nobody is refused more of it, so nothing can fail.
  const auto thread = static_cast<id_t>(gettid());
  setpriority(PRIO_PROCESS, thread, getpriority(PRIO_PROCESS, thread) + steps);
}

}  // namespace strata
