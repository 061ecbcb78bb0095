// The connections of browsers, counted and bounded.
#ifndef STRATA_SERVER_WEB_SESSIONS_H_
#define STRATA_SERVER_WEB_SESSIONS_H_

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace strata::server::web {

// One connection. Thread-safe.
class SessionBase {
 public:
  virtual ~SessionBase() = default;
  // Ends it and what it asked for; soon, on its own thread.
  virtual void Close() = 0;
};

// Where there are as many as there may be, one that comes takes the place of the one that has
// brought no whole request for the longest time: who opens connections and says nothing keeps
// nobody out. Thread-safe.
class Sessions {
 public:
  // `most_bytes`: of large bodies that are on their way in or out, all together.
  Sessions(std::size_t most, std::size_t most_bytes) : most_(most), most_bytes_(most_bytes) {}

  // Takes it in as one that waits; false: there is no room, since all are being answered, or the
  // server ends.
  bool Add(const std::shared_ptr<SessionBase>& session);
  // Once it has ended. Of one that was not taken in: nothing.
  void Remove(const SessionBase* session);
  // It waits for a request again, or has one.
  void SetWaiting(const SessionBase* session, bool waiting);
  // Ends all, and none comes in from now on.
  void CloseAll();

  // Books the size of a body; false: there is no room. GiveBytes() must follow.
  bool TakeBytes(std::size_t bytes);
  void GiveBytes(std::size_t bytes);

  std::size_t count() const;
  // Connections that were sent away or ended for want of room.
  std::uint64_t refused() const;

 private:
  struct Entry {
    std::weak_ptr<SessionBase> session;
    std::list<const SessionBase*>::iterator waiting;  // end(): it has a request
  };

  const std::size_t most_;
  const std::size_t most_bytes_;
  mutable absl::Mutex mutex_;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  std::size_t bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t refused_ ABSL_GUARDED_BY(mutex_) = 0;
  std::list<const SessionBase*> waiting_ ABSL_GUARDED_BY(mutex_);  // longest first
  std::map<const SessionBase*, Entry> all_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_SESSIONS_H_
