#include "core/common/this_thread.h"

#include <array>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

namespace strata {
namespace {

std::string NameOfThisThread() {
  std::array<char, 64> name{};
  EXPECT_EQ(pthread_getname_np(pthread_self(), name.data(), name.size()), 0);
  return name.data();
}

TEST(ThisThreadTest, NameGoesToTheThreadsItStarts) {
  std::thread([] {
    NameThisThread("job");
    EXPECT_EQ(NameOfThisThread(), "job");
    std::thread([] { EXPECT_EQ(NameOfThisThread(), "job"); }).join();
  }).join();
}

TEST(ThisThreadTest, LongNameIsCut) {
  std::thread([] {
    NameThisThread("a name beyond fifteen");
    EXPECT_EQ(NameOfThisThread(), "a name beyond f");
  }).join();
}

int NicenessOfThisThread() { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); }

TEST(ThisThreadTest, YieldsAsDoTheThreadsItStarts) {
  const int usual = NicenessOfThisThread();
  std::thread([usual] {
    YieldThisThread(2);
    EXPECT_EQ(NicenessOfThisThread(), usual + 2);
    std::thread([usual] { EXPECT_EQ(NicenessOfThisThread(), usual + 2); }).join();
  }).join();
  EXPECT_EQ(NicenessOfThisThread(), usual);
}

}  // namespace
}  // namespace strata
