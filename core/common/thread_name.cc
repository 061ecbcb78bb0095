#include "core/common/thread_name.h"

#include <string>

#include <pthread.h>

namespace strata {

void NameThisThread(const char* name) {
  constexpr std::size_t kMaxLength = 15;  // Linux refuses longer ones
  pthread_setname_np(pthread_self(), std::string(name).substr(0, kMaxLength).c_str());
}

}  // namespace strata
