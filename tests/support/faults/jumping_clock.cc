// Preloaded (LD_PRELOAD) into a program, sets its wall clock forward or back while it runs: by the
// nanoseconds that the file $STRATA_CLOCK_FILE holds, a std::int64_t that somebody else writes. The
// monotonic clock and waits for a while stay; a wait until a time of the wall clock (absl::Mutex)
// is that of the set clock, as it would be by the kernel.
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <ctime>

#include <dlfcn.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kSlice = 20'000'000;  // how late a wait notices that the clock was set

std::int64_t Offset() {
  static const std::atomic<std::int64_t>* const offset = [] {
    const char* name = std::getenv("STRATA_CLOCK_FILE");
    const int file = name == nullptr ? -1 : open(name, O_RDONLY | O_CLOEXEC);
    void* page =
        file < 0 ? MAP_FAILED : mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, file, 0);
    if (file >= 0) close(file);
    return page == MAP_FAILED ? nullptr : static_cast<std::atomic<std::int64_t>*>(page);
  }();
  return offset == nullptr ? 0 : offset->load(std::memory_order_relaxed);
}

template <typename Function>
Function Next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

std::int64_t ToNanoseconds(const timespec& t) { return t.tv_sec * kSecond + t.tv_nsec; }
timespec ToTimespec(std::int64_t ns) { return {ns / kSecond, ns % kSecond}; }

int TrueClock(clockid_t id, timespec* t) {
  static const auto next = Next<int (*)(clockid_t, timespec*)>("clock_gettime");
  return next(id, t);
}

std::int64_t TrueNow() {
  timespec t{};
  TrueClock(CLOCK_REALTIME, &t);
  return ToNanoseconds(t);
}

long TrueSyscall(long number, const long* a) {
  static const auto next = Next<long (*)(long, ...)>("syscall");
  return next(number, a[0], a[1], a[2], a[3], a[4], a[5]);
}

// FUTEX_WAIT_BITSET until a time of the set clock, in slices.
long WaitUntil(long* a) {
  const std::int64_t until = ToNanoseconds(*reinterpret_cast<const timespec*>(a[3]));
  while (true) {
    const std::int64_t true_until = until - Offset();
    const std::int64_t slice = std::max<std::int64_t>(0, std::min(true_until, TrueNow() + kSlice));
    const timespec end = ToTimespec(slice);
    a[3] = reinterpret_cast<long>(&end);
    const long result = TrueSyscall(SYS_futex, a);
    if (result != -1 || errno != ETIMEDOUT || until - Offset() <= TrueNow()) return result;
  }
}

}  // namespace

extern "C" {

int clock_gettime(clockid_t id, timespec* t) noexcept {
  const int result = TrueClock(id, t);
  if (result == 0 && (id == CLOCK_REALTIME || id == CLOCK_REALTIME_COARSE)) {
    *t = ToTimespec(ToNanoseconds(*t) + Offset());
  }
  return result;
}

int gettimeofday(timeval* t, void*) noexcept {
  const std::int64_t now = TrueNow() + Offset();
  t->tv_sec = now / kSecond;
  t->tv_usec = now % kSecond / 1000;
  return 0;
}

time_t time(time_t* t) noexcept {
  const time_t now = (TrueNow() + Offset()) / kSecond;
  if (t != nullptr) *t = now;
  return now;
}

long syscall(long number, ...) noexcept {
  std::va_list arguments;
  va_start(arguments, number);
  long a[6];
  for (long& argument : a) argument = va_arg(arguments, long);
  va_end(arguments);
  const bool waits = number == SYS_futex && (a[1] & FUTEX_CLOCK_REALTIME) != 0 &&
                     (a[1] & FUTEX_CMD_MASK) == FUTEX_WAIT_BITSET && a[3] != 0;
  return waits ? WaitUntil(a) : TrueSyscall(number, a);
}

}  // extern "C"
