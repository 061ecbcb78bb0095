#include "server/rpc/executor.h"

#include <new>
#include <system_error>
#include <utility>

#include "core/common/blocking.h"
#include "core/common/this_thread.h"

namespace strata::server {

// One task's thread.
class Executor::LentThread final : public BlockingObserver {
 public:
  LentThread(Executor& executor, Client& client) : executor_(executor), client_(client) {
    SetBlockingObserver(this);
  }
  ~LentThread() override { SetBlockingObserver(nullptr); }
  LentThread(const LentThread&) = delete;
  LentThread& operator=(const LentThread&) = delete;

  void BlockingBegins() override {
    absl::MutexLock lock(&executor_.mutex_);
    blocked_ = executor_.blocked_ < kMostBlocked && client_.blocked < kMostBlocked / 4;
    if (!blocked_) return;
    ++executor_.blocked_;
    --executor_.running_;
    executor_.Change(client_, [this] {
      ++client_.blocked;
      --client_.running;
    });
    executor_.Dispatch();
  }

  void BlockingEnds(bool in_turn) override {
    if (!blocked_) return;
    absl::MutexLock lock(&executor_.mutex_);
    if (in_turn) {
      Resumed resumed;
      executor_.Change(client_, [&] {
        Resumed*& last = client_.last_resumed;
        (last == nullptr ? client_.first_resumed : last->next) = &resumed;
        last = &resumed;
      });
      executor_.Dispatch();
      executor_.mutex_.Await(absl::Condition(&resumed.has_place));
    } else {
      ++executor_.running_;
      executor_.Change(client_, [this] { ++client_.running; });
    }
    --executor_.blocked_;
    --client_.blocked;
  }

 private:
  Executor& executor_;
  Client& client_;
  bool blocked_ = false;
};

Executor::Executor(int places, const char* name)
    : places_(static_cast<std::size_t>(places)), name_(name) {
  absl::MutexLock lock(&mutex_);
  AddThread();
}

void Executor::AddThread() {
  for (std::thread& thread : ended_) thread.join();
  ended_.clear();
  std::list<std::thread> added(1);
  const auto self = added.begin();
  *self = std::thread([this, self] {
    NameThisThread(name_);
    Work(self);
  });
  ++starting_;
  threads_.splice(threads_.end(), added);
}

Executor::~Executor() {
  // What blocks may need further threads to get on.
  for (bool more = true; more;) {
    std::list<std::thread> threads;
    {
      absl::MutexLock lock(&mutex_);
      closing_ = true;
      threads.swap(threads_);
    }
    more = !threads.empty();
    for (std::thread& thread : threads) thread.join();
  }
  absl::MutexLock lock(&mutex_);
  for (std::thread& thread : ended_) thread.join();
}

ExecutorNumbers Executor::numbers() const {
  absl::MutexLock lock(&mutex_);
  return {.running = running_, .blocked = blocked_, .queued = queued_};
}

Executor::Client& Executor::Of(absl::string_view name) {
  const auto found = clients_.find(name);
  if (found != clients_.end()) return found->second;
  Client made;
  made.name = std::string(name);
  Waiting one{{0, 0, nullptr}};
  made.entry = one.extract(one.begin());
  std::string key = made.name;
  return clients_.emplace(std::move(key), std::move(made)).first->second;
}

void Executor::Change(Client& client, absl::FunctionRef<void()> change) {
  if (client.entry.empty()) {
    client.entry = waiting_.extract({client.running, client.turn, &client});
  }
  change();
  if (!client.waits()) return;
  client.entry.value() = {client.running, client.turn, &client};
  waiting_.insert(std::move(client.entry));
}

void Executor::Submit(absl::string_view client, std::function<void()> task) {
  std::list<Task> added;
  added.push_back({nullptr, std::move(task)});
  absl::MutexLock lock(&mutex_);
  Client& whose = Of(client);
  added.front().client = &whose;
  Change(whose, [&] { whose.tasks.splice(whose.tasks.end(), added); });
  ++queued_;
  Dispatch();
}

bool Executor::HasPlaceFor(const Client& client) const {
  return running_ < places_ || (client.running == 0 && running_ < 2 * places_);
}

void Executor::Dispatch() {
  while (!waiting_.empty()) {
    Client& client = *std::get<Client*>(*waiting_.begin());
    if (!HasPlaceFor(client)) return;
    GivePlaceTo(client);
  }
}

void Executor::GivePlaceTo(Client& client) {
  ++running_;
  Change(client, [&]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    ++client.running;
    client.turn = ++turns_;
    if (client.first_resumed != nullptr) {
      Resumed& resumed = *client.first_resumed;
      client.first_resumed = resumed.next;
      if (resumed.next == nullptr) client.last_resumed = nullptr;
      resumed.has_place = true;
      return;
    }
    begun_.splice(begun_.end(), client.tasks, client.tasks.begin());
    --queued_;
  });
  if (begun_.size() <= idle_ + starting_) return;
  try {
    AddThread();
  } catch (const std::system_error&) {
    // The system has no more to give; those that are there take it in their turn.
  } catch (const std::bad_alloc&) {
  }
}

std::list<Executor::Task> Executor::Take() {
  std::list<Task> begun;
  if (begun_.empty() && !closing_ && idle_ >= places_) return begun;
  ++idle_;
  mutex_.Await(absl::Condition(this, &Executor::Ready));
  --idle_;
  if (!begun_.empty()) begun.splice(begun.end(), begun_, begun_.begin());
  return begun;
}

void Executor::Work(std::list<std::thread>::iterator self) {
  bool started = false;
  while (true) {
    std::list<Task> begun;
    {
      absl::MutexLock lock(&mutex_);
      if (!std::exchange(started, true)) --starting_;
      begun = Take();
      if (begun.empty()) {
        // While it closes, the destructor has the threads.
        if (!closing_) ended_.splice(ended_.end(), threads_, self);
        return;
      }
    }
    Client& client = *begun.front().client;
    {
      const LentThread lent(*this, client);
      begun.front().run();
      begun.clear();  // what it holds may be much
    }
    Finished(client);
  }
}

void Executor::Finished(Client& client) {
  absl::MutexLock lock(&mutex_);
  --running_;
  Change(client, [&client] { --client.running; });
  Dispatch();
  if (client.running == 0 && client.blocked == 0 && !client.waits()) clients_.erase(client.name);
}

}  // namespace strata::server
