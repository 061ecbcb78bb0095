#include "tests/support/faults/failing_memory.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>

namespace {

std::atomic<bool> fails{false};
std::atomic<std::int64_t> until_failure{0};  // allocations that succeed first
std::atomic<std::int64_t> failures_left{0};
std::atomic<std::int64_t> failures{0};

bool Fails() {
  if (!fails.load(std::memory_order_relaxed)) return false;
  if (until_failure.fetch_sub(1) > 0) return false;
  if (failures_left.fetch_sub(1) <= 0) return false;
  ++failures;
  return true;
}

void* Allocate(std::size_t size, std::size_t alignment) {
  if (Fails()) throw std::bad_alloc();
  void* const place = alignment > __STDCPP_DEFAULT_NEW_ALIGNMENT__
                          ? std::aligned_alloc(alignment, (size + alignment - 1) & ~(alignment - 1))
                          : std::malloc(size == 0 ? 1 : size);
  if (place == nullptr) throw std::bad_alloc();
  return place;
}

}  // namespace

void* operator new(std::size_t size) { return Allocate(size, 0); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return Allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* place) noexcept { std::free(place); }
void operator delete(void* place, std::size_t) noexcept { std::free(place); }
void operator delete(void* place, std::align_val_t) noexcept { std::free(place); }
void operator delete(void* place, std::size_t, std::align_val_t) noexcept { std::free(place); }

namespace strata::testing {

FailingMemory::FailingMemory(std::int64_t first, std::int64_t count) {
  failures = 0;
  until_failure = first;
  failures_left = count;
  fails = true;
}

FailingMemory::~FailingMemory() { fails = false; }

std::int64_t FailingMemory::failed() const { return failures; }

}  // namespace strata::testing
