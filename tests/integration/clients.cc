#include "tests/integration/clients.h"

#include <utility>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gtest/gtest.h>

#include "client/sdk/client.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {

std::unique_ptr<api::Database> ConnectPatiently(const std::string& address) {
  ClientOptions options;
  options.target = address;
  options.backoff.initial = absl::Milliseconds(20);
  options.backoff.max_attempts = 20;
  auto client = Connect(options);
  EXPECT_THAT(client, IsOk());
  return client.ok() ? *std::move(client) : nullptr;
}

void Clients::Add(const std::string& target, Step step) {
  ClientOptions options;
  options.target = target;
  absl::StatusOr<std::unique_ptr<api::Database>> connected = Connect(options);
  STRATA_ASSERT_OK(connected);
  connections_.push_back(*std::move(connected));
  api::Database* const db = connections_.back().get();
  threads_.emplace_back([this, db, step = std::move(step)] {
    while (!call_.stop.requested()) {
      step(*db, call_);
      absl::SleepFor(absl::Milliseconds(5));
    }
  });
}

void Clients::Stop() {
  call_.stop.Request();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

}  // namespace strata::testing
