#include "core/engine/map/aside.h"

#include <new>

#include "absl/status/status.h"
#include "absl/synchronization/notification.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

TEST(AsideTest, RunsBesideItsCaller) {
  absl::Notification asked;
  absl::Notification answered;
  Aside aside("aside", [&] {
    asked.WaitForNotification();
    answered.Notify();
    return absl::NotFoundError("nothing");
  });
  asked.Notify();
  answered.WaitForNotification();
  EXPECT_THAT(aside.Await(), StatusIs(absl::StatusCode::kNotFound, HasSubstr("nothing")));
  EXPECT_THAT(aside.Await(), StatusIs(absl::StatusCode::kNotFound, HasSubstr("nothing")));
}

TEST(AsideTest, AnAllocationThatFailsIsAnError) {
  Aside aside("aside", []() -> absl::Status { throw std::bad_alloc(); });
  EXPECT_THAT(aside.Await(),
              StatusIs(absl::StatusCode::kResourceExhausted, HasSubstr("out of memory")));
}

TEST(AsideTest, IsWaitedForWhereNobodyAsks) {
  bool done = false;
  {
    const Aside aside("aside", [&done] {
      done = true;
      return absl::OkStatus();
    });
  }
  EXPECT_TRUE(done);
}

}  // namespace
}  // namespace strata
