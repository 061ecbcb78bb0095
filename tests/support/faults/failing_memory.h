// Memory that runs out on demand: a program linked with it has its own operator new.
#ifndef STRATA_TESTS_SUPPORT_FAULTS_FAILING_MEMORY_H_
#define STRATA_TESTS_SUPPORT_FAULTS_FAILING_MEMORY_H_

#include <cstdint>

namespace strata::testing {

// While it lives allocations of all threads fail from the `first` next one on, `count` of them.
// One at a time.
class FailingMemory {
 public:
  FailingMemory(std::int64_t first, std::int64_t count);
  ~FailingMemory();
  FailingMemory(const FailingMemory&) = delete;
  FailingMemory& operator=(const FailingMemory&) = delete;

  // How many have failed so far.
  std::int64_t failed() const;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_FAULTS_FAILING_MEMORY_H_
