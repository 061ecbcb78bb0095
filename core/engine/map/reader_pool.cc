#include "core/engine/map/reader_pool.h"

#include <cstddef>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "core/common/guarded.h"
#include "core/common/status.h"
#include "core/storage/storage.h"

namespace strata {

absl::StatusOr<ReaderPool::Lease> ReaderPool::Take() {
  {
    absl::MutexLock lock(&mutex_);
    STRATA_RETURN_IF_ERROR(closed_);
    ++on_loan_;
    if (!idle_.empty()) {
      Lease lease(*this, std::move(idle_.back()));
      idle_.pop_back();
      return lease;
    }
  }
  // It is on loan until it says otherwise, whatever happens.
  absl::StatusOr<std::unique_ptr<StorageReader>> reader =
      Guarded([this] { return storage_.NewReader(); });
  if (reader.ok()) return Lease(*this, *std::move(reader));
  absl::MutexLock lock(&mutex_);
  --on_loan_;
  return reader.status();
}

void ReaderPool::Return(std::unique_ptr<StorageReader> reader) {
  absl::MutexLock lock(&mutex_);
  if (closed_.ok() && idle_.size() < kMaxIdle) idle_.push_back(std::move(reader));
  reader.reset();  // a connection is closed before Close() can see it returned
  --on_loan_;
}

void ReaderPool::Close(const absl::Status& why) {
  absl::MutexLock lock(&mutex_);
  if (closed_.ok()) closed_ = why;
  idle_.clear();
  const auto all_back = [this]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return on_loan_ == 0; };
  mutex_.Await(absl::Condition(&all_back));
}

}  // namespace strata
