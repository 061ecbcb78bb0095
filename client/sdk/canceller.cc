#include "client/sdk/canceller.h"

#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace strata::sdk {
namespace {

constexpr absl::Duration kInterval = absl::Milliseconds(10);

}  // namespace

Canceller::Canceller() : thread_([this] { Work(); }) {}

Canceller::~Canceller() {
  {
    absl::MutexLock lock(&mutex_);
    closing_ = true;
  }
  thread_.join();
}

Canceller::Watch::Watch(Canceller& canceller, const Stop& stop, grpc::ClientContext& context)
    : canceller_(canceller), stop_(stop), context_(context) {
  absl::MutexLock lock(&canceller_.mutex_);
  place_ = canceller_.watches_.insert(canceller_.watches_.end(), this);
}

Canceller::Watch::~Watch() {
  absl::MutexLock lock(&canceller_.mutex_);
  canceller_.watches_.erase(place_);
}

void Canceller::Work() {
  const auto needed = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return closing_ || !watches_.empty();
  };
  while (true) {
    {
      absl::MutexLock lock(&mutex_);
      mutex_.Await(absl::Condition(&needed));
      if (closing_) return;
      for (Watch* watch : watches_) {
        if (watch->stop_.requested()) watch->context_.TryCancel();
      }
    }
    absl::SleepFor(kInterval);  // AwaitWithTimeout would wait as long as a clock is set back
  }
}

}  // namespace strata::sdk
