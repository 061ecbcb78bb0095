#include "server/readiness.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include <glog/logging.h>

#include "core/common/guarded.h"
#include "core/common/log_line.h"
#include "core/common/this_thread.h"

namespace strata::server {
namespace {

bool AllWell(const std::map<std::string, std::string>& state) {
  return std::all_of(
      state.begin(), state.end(), [](const auto& cause) { return cause.second.empty(); });
}

}  // namespace

Readiness::Readiness(std::vector<ReadinessCheck> checks,
                     absl::Duration interval,
                     std::function<void(bool)> tell)
    : checks_(std::move(checks)), interval_(interval), tell_(std::move(tell)) {
  tell_(true);
  Look();
  thread_ = std::thread([this] { Loop(); });
}

Readiness::~Readiness() {
  {
    absl::MutexLock lock(&mutex_);
    closing_ = true;
  }
  thread_.join();
}

std::map<std::string, std::string> Readiness::state() const {
  absl::MutexLock lock(&mutex_);
  return state_;
}

void Readiness::Look() {
  std::map<std::string, std::string> now;
  for (const ReadinessCheck& check : checks_) now[check.cause] = check.why();
  std::map<std::string, std::string> before = state();
  for (const auto& [cause, why] : now) {
    if (why.empty() == before[cause].empty()) continue;
    if (why.empty()) {
      LOG(INFO) << LogLine("ready").Add("cause", cause).Add("ready", "yes");
    } else {
      LOG(ERROR) << LogLine("ready").Add("cause", cause).Add("ready", "no").Add("why", why);
    }
  }
  const bool well = AllWell(now);
  {
    absl::MutexLock lock(&mutex_);
    state_ = std::move(now);
  }
  if (well != AllWell(before)) tell_(well);
}

void Readiness::Loop() {
  NameThisThread("readiness");
  while (true) {
    {
      absl::MutexLock lock(&mutex_);
      if (mutex_.AwaitWithTimeout(absl::Condition(&closing_), interval_)) return;
    }
    // What there is no memory to look at now is looked at next time.
    Guarded([this] {
      Look();
      return absl::OkStatus();
    }).IgnoreError();
  }
}

}  // namespace strata::server
