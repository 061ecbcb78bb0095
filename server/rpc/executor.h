// A pool of threads for calls that block, so that gRPC's own threads never do.
#ifndef STRATA_SERVER_RPC_EXECUTOR_H_
#define STRATA_SERVER_RPC_EXECUTOR_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"

namespace strata::server {

struct ExecutorNumbers {
  std::size_t running = 0;  // tasks that hold a place
  std::size_t blocked = 0;  // tasks that gave theirs back for a while
  std::size_t queued = 0;   // tasks that wait for their first one
};

// Runs tasks in `places`, each on a thread of its own. No client keeps another one waiting:
// - a place that gets free goes to the client that holds the fewest, in turn among equals;
// - a client that holds none waits for none: there are as many spare places for such;
// - a task inside a BlockingScope gives its place back until the scope ends. Blocked tasks cost a
//   thread each: up to kMostBlocked, of one client a quarter of that; further ones keep their
//   places.
// Tasks of one client begin in the order submitted. Threads beyond `places` end when they are idle.
// Thread-safe. The queues are as long as there are calls under way, which Runtime bounds: a call
// has few tasks at a time.
class Executor {
 public:
  static constexpr std::size_t kMostBlocked = 512;

  // `name` is that of the threads and must outlive them. REQUIRES: places ≥ 1.
  Executor(int places, const char* name);
  // Runs what was submitted, then joins the threads.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // `client`: whose turn it is. `task` must not throw; where there is no memory for it, nothing was
  // submitted.
  void Submit(absl::string_view client, std::function<void()> task);

  const char* name() const { return name_; }
  ExecutorNumbers numbers() const;

 private:
  struct Client;
  struct Task {
    Client* client;
    std::function<void()> run;
  };
  // A blocked task that wants its place again; on its thread's stack.
  struct Resumed {
    bool has_place = false;
    Resumed* next = nullptr;
  };
  // Those that wait for a place: running, turn.
  using Waiting = std::set<std::tuple<std::size_t, std::uint64_t, Client*>>;
  // Once there, it goes through its states without memory: waits end in destructors.
  struct Client {
    std::string name;
    std::size_t running = 0;
    std::size_t blocked = 0;
    std::uint64_t turn = 0;  // when it got its last place
    Resumed* first_resumed = nullptr;
    Resumed* last_resumed = nullptr;
    std::list<Task> tasks;
    Waiting::node_type entry;  // while it does not wait for a place
    bool waits() const { return first_resumed != nullptr || !tasks.empty(); }
  };
  class LentThread;  // tells of a task's waits

  Client& Of(absl::string_view name) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // `change` may do anything to the client but its name; afterwards it stands where it belongs.
  void Change(Client& client, absl::FunctionRef<void()> change)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Gives places to whose turn it is.
  void Dispatch() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool HasPlaceFor(const Client& client) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void GivePlaceTo(Client& client) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void AddThread() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // `self`: where the thread is among threads_.
  void Work(std::list<std::thread>::iterator self);
  // Empty: the thread is not needed any more.
  std::list<Task> Take() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Finished(Client& client);
  bool Ready() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return closing_ || !begun_.empty(); }

  const std::size_t places_;
  const char* const name_;
  mutable absl::Mutex mutex_;
  std::map<std::string, Client, std::less<>> clients_ ABSL_GUARDED_BY(mutex_);
  Waiting waiting_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t turns_ ABSL_GUARDED_BY(mutex_) = 0;
  std::size_t running_ ABSL_GUARDED_BY(mutex_) = 0;
  std::size_t blocked_ ABSL_GUARDED_BY(mutex_) = 0;
  std::size_t queued_ ABSL_GUARDED_BY(mutex_) = 0;
  std::list<Task> begun_ ABSL_GUARDED_BY(mutex_);  // have their place, wait for a thread
  bool closing_ ABSL_GUARDED_BY(mutex_) = false;
  std::size_t idle_ ABSL_GUARDED_BY(mutex_) = 0;      // threads that wait for a task
  std::size_t starting_ ABSL_GUARDED_BY(mutex_) = 0;  // threads that will
  std::list<std::thread> threads_ ABSL_GUARDED_BY(mutex_);
  std::list<std::thread> ended_ ABSL_GUARDED_BY(mutex_);  // to be joined
};

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_EXECUTOR_H_
