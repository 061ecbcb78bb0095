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
    bool has_place = !in_turn;
    if (in_turn) {
      executor_.Change(client_, [&] { client_.resumed.push_back(&has_place); });
      executor_.Dispatch();
      executor_.mutex_.Await(absl::Condition(&has_place));
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
  std::thread thread([this] {
    NameThisThread(name_);
    Work();
  });
  ++starting_;
  const std::thread::id id = thread.get_id();
  threads_.emplace(id, std::move(thread));
}

Executor::~Executor() {
  // What blocks may need further threads to get on.
  for (bool more = true; more;) {
    std::map<std::thread::id, std::thread> threads;
    {
      absl::MutexLock lock(&mutex_);
      closing_ = true;
      threads.swap(threads_);
    }
    more = !threads.empty();
    for (auto& [id, thread] : threads) thread.join();
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
  Client& client = clients_[std::string(name)];
  client.name = std::string(name);
  return client;
}

void Executor::Change(Client& client, absl::FunctionRef<void()> change) {
  waiting_.erase({client.running, client.turn, &client});
  change();
  if (client.waits()) waiting_.insert({client.running, client.turn, &client});
}

void Executor::Submit(absl::string_view client, std::function<void()> task) {
  absl::MutexLock lock(&mutex_);
  Client& whose = Of(client);
  Change(whose, [&] { whose.tasks.push_back(std::move(task)); });
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
    if (!client.resumed.empty()) {
      *client.resumed.front() = true;
      client.resumed.pop_front();
      return;
    }
    begun_.push_back({&client, std::move(client.tasks.front())});
    client.tasks.pop_front();
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

bool Executor::Take(Begun& begun) {
  if (begun_.empty() && !closing_ && idle_ >= places_) return false;
  ++idle_;
  mutex_.Await(absl::Condition(this, &Executor::Ready));
  --idle_;
  if (begun_.empty()) return false;
  begun = std::move(begun_.front());
  begun_.pop_front();
  return true;
}

void Executor::Work() {
  bool started = false;
  while (true) {
    Begun begun;
    {
      absl::MutexLock lock(&mutex_);
      if (!std::exchange(started, true)) --starting_;
      if (!Take(begun)) {
        const auto self = threads_.find(std::this_thread::get_id());
        if (self == threads_.end()) return;  // the destructor joins it
        ended_.push_back(std::move(self->second));
        threads_.erase(self);
        return;
      }
    }
    {
      const LentThread lent(*this, *begun.client);
      begun.task();
      begun.task = nullptr;  // what it holds may be much
    }
    Finished(*begun.client);
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
