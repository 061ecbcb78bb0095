// Read-only connections on loan.
#ifndef STRATA_CORE_ENGINE_MAP_READER_POOL_H_
#define STRATA_CORE_ENGINE_MAP_READER_POOL_H_

#include <memory>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "core/storage/storage.h"

namespace strata {

// Thread-safe.
class ReaderPool {
 public:
  // A reader that goes back when the lease is destroyed. Hold it for reads only, never while a
  // client is waited for.
  class Lease {
   public:
    Lease(ReaderPool& pool, std::unique_ptr<StorageReader> reader)
        : pool_(&pool), reader_(std::move(reader)) {}
    ~Lease() {
      if (reader_ != nullptr) pool_->Return(std::move(reader_));
    }
    Lease(Lease&&) = default;
    Lease& operator=(Lease&&) = delete;
    StorageReader* operator->() const { return reader_.get(); }
    StorageReader& operator*() const { return *reader_; }

   private:
    ReaderPool* pool_;
    std::unique_ptr<StorageReader> reader_;
  };

  explicit ReaderPool(MapStorage& storage) : storage_(storage) {
    idle_.reserve(kMaxIdle);  // a reader goes back without a need for memory
  }

  // The status of Close() once closed.
  absl::StatusOr<Lease> Take();
  // Refuses new leases with `why`, waits for those on loan and closes every connection.
  void Close(const absl::Status& why);

 private:
  static constexpr std::size_t kMaxIdle = 8;

  void Return(std::unique_ptr<StorageReader> reader);

  MapStorage& storage_;
  absl::Mutex mutex_;
  std::vector<std::unique_ptr<StorageReader>> idle_ ABSL_GUARDED_BY(mutex_);
  int on_loan_ ABSL_GUARDED_BY(mutex_) = 0;
  absl::Status closed_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_READER_POOL_H_
