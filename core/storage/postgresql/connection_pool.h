// Connections to one database, shared by all that use it.
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_CONNECTION_POOL_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_CONNECTION_POOL_H_

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/storage/postgresql/connection.h"

namespace strata {

// Thread-safe.
class ConnectionPool : public std::enable_shared_from_this<ConnectionPool> {
 public:
  // A connection on loan; one thread at a time. What is broken, or in a transaction, is closed.
  class Lease {
   public:
    Lease(std::shared_ptr<ConnectionPool> pool, std::unique_ptr<Connection> connection)
        : pool_(std::move(pool)), connection_(std::move(connection)) {}
    ~Lease();
    Lease(Lease&&) = default;
    Lease& operator=(Lease&&) = delete;
    Connection& operator*() const { return *connection_; }
    Connection* operator->() const { return connection_.get(); }

   private:
    std::shared_ptr<ConnectionPool> pool_;
    std::unique_ptr<Connection> connection_;
  };

  // At most `most` are open at a time.
  static std::shared_ptr<ConnectionPool> Make(std::string where, std::size_t most);

  // RESOURCE_EXHAUSTED if none becomes free for ten seconds; the errors of Connection::Open().
  absl::StatusOr<Lease> Take();

 private:
  ConnectionPool(std::string where, std::size_t most) : where_(std::move(where)), most_(most) {}
  void GiveBack(std::unique_ptr<Connection> connection);
  bool HasOne() const ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return !idle_.empty() || open_ < most_; }

  const std::string where_;
  const std::size_t most_;
  absl::Mutex mutex_;
  std::size_t open_ ABSL_GUARDED_BY(mutex_) = 0;
  std::vector<std::unique_ptr<Connection>> idle_ ABSL_GUARDED_BY(mutex_);  // of those, newest last
};

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_CONNECTION_POOL_H_
