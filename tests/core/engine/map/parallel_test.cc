#include "core/engine/map/parallel.h"

#include <atomic>
#include <new>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

TEST(ParallelTest, AnAllocationThatFailsEndsTheLoop) {
  std::atomic<int> begun = 0;
  const absl::Status done = ParallelFor(4, 1000, [&](int, std::size_t i) -> absl::Status {
    ++begun;
    if (i == 5) throw std::bad_alloc();
    return absl::OkStatus();
  });
  EXPECT_THAT(done, StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("out of memory")));
  EXPECT_GE(begun, 6);
}

// In a child: a process that may have no more threads.
TEST(ParallelTest, WithoutThreadsOneDoesItAll) {
  const pid_t child = fork();
  if (child == 0) {
    if (setgid(65534) != 0 || setuid(65534) != 0) _exit(77);  // the limit does not hold for root
    const rlimit none{1, 1};
    if (setrlimit(RLIMIT_NPROC, &none) != 0) _exit(77);
    std::atomic<int> count = 0;
    const absl::Status done = ParallelFor(8, 100, [&](int, std::size_t) {
      ++count;
      return absl::OkStatus();
    });
    _exit(done.ok() && count == 100 ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status)) << "ended by signal " << WTERMSIG(status);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "only root can give up its rights";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace strata
