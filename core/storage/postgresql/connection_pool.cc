#include "core/storage/postgresql/connection_pool.h"

#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

#include "core/storage/postgresql/connection.h"

namespace strata {
namespace {

constexpr absl::Duration kLongestWait = absl::Seconds(10);
constexpr std::size_t kMostIdle = 8;

}  // namespace

std::shared_ptr<ConnectionPool> ConnectionPool::Make(std::string where, std::size_t most) {
  return std::shared_ptr<ConnectionPool>(new ConnectionPool(std::move(where), most));
}

ConnectionPool::Lease::~Lease() {
  if (pool_ != nullptr) pool_->GiveBack(std::move(connection_));
}

absl::StatusOr<ConnectionPool::Lease> ConnectionPool::Take() {
  while (true) {
    std::unique_ptr<Connection> connection;
    {
      absl::MutexLock lock(&mutex_);
      if (!mutex_.AwaitWithTimeout(absl::Condition(this, &ConnectionPool::HasOne), kLongestWait)) {
        return absl::ResourceExhaustedError(
            absl::StrCat("store: all ", most_, " connections to the database are in use"));
      }
      if (idle_.empty()) {
        ++open_;
      } else {
        connection = std::move(idle_.back());
        idle_.pop_back();
      }
    }
    if (connection == nullptr) {
      absl::StatusOr<std::unique_ptr<Connection>> made = Connection::Open(where_);
      if (made.ok()) return Lease(shared_from_this(), *std::move(made));
      absl::MutexLock lock(&mutex_);
      --open_;
      return made.status();
    }
    if (connection->IsFresh()) return Lease(shared_from_this(), std::move(connection));
    GiveBack(std::move(connection));
  }
}

void ConnectionPool::GiveBack(std::unique_ptr<Connection> connection) {
  const bool fresh = connection->IsFresh();
  absl::MutexLock lock(&mutex_);
  if (fresh && idle_.size() < kMostIdle) {
    connection->ForgetError();
    idle_.push_back(std::move(connection));
  } else {
    --open_;
    connection.reset();
  }
}

}  // namespace strata
