// Debian's Abseil is built without -fsanitize=thread, so ThreadSanitizer would not see that its
// mutex orders anything, nor that copies of a status count their owners. In the tsan build the
// linker sends every such call of our own objects here (--wrap, see tests/CMakeLists.txt) and each
// announces itself as Abseil's annotations would. Between pre_… and post_… the thread is not
// watched: there Abseil may evaluate the condition of another thread that waits for the same mutex.
#include <cstdint>

#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <sanitizer/tsan_interface.h>

#define STRATA_WRAP(function) asm("__wrap__ZN4absl7debian3" function)
#define STRATA_REAL(function) asm("__real__ZN4absl7debian3" function)

using absl::Condition;
using absl::Duration;
using absl::Mutex;

void RealDestroy(Mutex* mutex) STRATA_REAL("5MutexD1Ev");
void RealLock(Mutex* mutex) STRATA_REAL("5Mutex4LockEv");
void RealUnlock(Mutex* mutex) STRATA_REAL("5Mutex6UnlockEv");
void RealAwait(Mutex* mutex, const Condition& condition)
    STRATA_REAL("5Mutex5AwaitERKNS0_9ConditionE");
bool RealAwaitWithTimeout(Mutex* mutex, const Condition& condition, Duration timeout)
    STRATA_REAL("5Mutex16AwaitWithTimeoutERKNS0_9ConditionENS0_8DurationE");

void RealUnref(std::uintptr_t status) STRATA_REAL("6Status15UnrefNonInlinedEm");

void WrapDestroy(Mutex* mutex) STRATA_WRAP("5MutexD1Ev");
void WrapLock(Mutex* mutex) STRATA_WRAP("5Mutex4LockEv");
void WrapUnlock(Mutex* mutex) STRATA_WRAP("5Mutex6UnlockEv");
void WrapAwait(Mutex* mutex, const Condition& condition)
    STRATA_WRAP("5Mutex5AwaitERKNS0_9ConditionE");
bool WrapAwaitWithTimeout(Mutex* mutex, const Condition& condition, Duration timeout)
    STRATA_WRAP("5Mutex16AwaitWithTimeoutERKNS0_9ConditionENS0_8DurationE");
void WrapUnref(std::uintptr_t status) STRATA_WRAP("6Status15UnrefNonInlinedEm");

namespace {

class Locking {
 public:
  explicit Locking(Mutex* mutex) : mutex_(mutex) { __tsan_mutex_pre_lock(mutex_, 0); }
  ~Locking() { __tsan_mutex_post_lock(mutex_, 0, 0); }
  Locking(const Locking&) = delete;
  Locking& operator=(const Locking&) = delete;

 private:
  Mutex* mutex_;
};

// A wait gives the mutex away and takes it again; what happens in between is one call of Abseil's.
Locking GiveAwayAndTake(Mutex* mutex) {
  __tsan_mutex_pre_unlock(mutex, 0);
  __tsan_mutex_post_unlock(mutex, 0);
  return Locking(mutex);
}

}  // namespace

void WrapDestroy(Mutex* mutex) {
  RealDestroy(mutex);
  __tsan_mutex_destroy(mutex, __tsan_mutex_not_static);
}

void WrapLock(Mutex* mutex) {
  const Locking locking(mutex);
  RealLock(mutex);
}

void WrapUnlock(Mutex* mutex) {
  __tsan_mutex_pre_unlock(mutex, 0);
  RealUnlock(mutex);
  __tsan_mutex_post_unlock(mutex, 0);
}

void WrapAwait(Mutex* mutex, const Condition& condition) {
  const Locking locking = GiveAwayAndTake(mutex);
  RealAwait(mutex, condition);
}

bool WrapAwaitWithTimeout(Mutex* mutex, const Condition& condition, Duration timeout) {
  const Locking locking = GiveAwayAndTake(mutex);
  return RealAwaitWithTimeout(mutex, condition, timeout);
}

// The last owner frees what the others have read.
void WrapUnref(std::uintptr_t status) {
  void* const owners = reinterpret_cast<void*>(status);
  __tsan_release(owners);
  __tsan_acquire(owners);
  RealUnref(status);
}
