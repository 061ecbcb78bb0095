#include "core/common/thread_name.h"

#include <array>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <pthread.h>

namespace strata {
namespace {

std::string NameOfThisThread() {
  std::array<char, 64> name{};
  EXPECT_EQ(pthread_getname_np(pthread_self(), name.data(), name.size()), 0);
  return name.data();
}

TEST(ThreadNameTest, GoesToTheThreadsItStarts) {
  std::thread([] {
    NameThisThread("job");
    EXPECT_EQ(NameOfThisThread(), "job");
    std::thread([] { EXPECT_EQ(NameOfThisThread(), "job"); }).join();
  }).join();
}

TEST(ThreadNameTest, IsCut) {
  std::thread([] {
    NameThisThread("a name beyond fifteen");
    EXPECT_EQ(NameOfThisThread(), "a name beyond f");
  }).join();
}

}  // namespace
}  // namespace strata
