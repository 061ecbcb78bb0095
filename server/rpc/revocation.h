// Calls that go on when those who made them may no longer.
#ifndef STRATA_SERVER_RPC_REVOCATION_H_
#define STRATA_SERVER_RPC_REVOCATION_H_

#include <set>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace strata::server {

// A call under way.
class Revocable {
 public:
  virtual ~Revocable() = default;
  // Quick; ends the call if its caller may no longer do what it does.
  virtual void EndIfRevoked() = 0;
};

// Asks all calls under way again and again, on a thread of its own: one that waits for the disk,
// for a reader or inside a search looks at no token. Thread-safe.
class RevocationWatch {
 public:
  explicit RevocationWatch(absl::Duration interval);
  ~RevocationWatch();
  RevocationWatch(const RevocationWatch&) = delete;
  RevocationWatch& operator=(const RevocationWatch&) = delete;

  // `call` is asked from now on until Remove() returns.
  void Add(Revocable& call);
  void Remove(Revocable& call);

 private:
  void Loop();

  const absl::Duration interval_;
  absl::Mutex mutex_;
  bool closing_ ABSL_GUARDED_BY(mutex_) = false;
  std::set<Revocable*> calls_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_REVOCATION_H_
