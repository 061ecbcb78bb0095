#include "server/web/sessions.h"

#include <iterator>
#include <utility>
#include <vector>

namespace strata::server::web {

bool Sessions::Add(const std::shared_ptr<SessionBase>& session) {
  std::shared_ptr<SessionBase> longest;
  {
    absl::MutexLock lock(&mutex_);
    if (closed_) return false;
    if (all_.size() >= most_) {
      ++refused_;
      if (waiting_.empty()) return false;
      const auto found = all_.find(waiting_.front());
      longest = found->second.session.lock();
      waiting_.pop_front();
      all_.erase(found);
    }
    waiting_.push_back(session.get());
    all_[session.get()] = {session, std::prev(waiting_.end())};
  }
  if (longest != nullptr) longest->Close();
  return true;
}

void Sessions::Remove(const SessionBase* session) {
  absl::MutexLock lock(&mutex_);
  const auto found = all_.find(session);
  if (found == all_.end()) return;
  if (found->second.waiting != waiting_.end()) waiting_.erase(found->second.waiting);
  all_.erase(found);
}

void Sessions::SetWaiting(const SessionBase* session, bool waiting) {
  absl::MutexLock lock(&mutex_);
  const auto found = all_.find(session);
  if (found == all_.end()) return;
  Entry& entry = found->second;
  if (entry.waiting != waiting_.end()) waiting_.erase(entry.waiting);
  entry.waiting = waiting ? waiting_.insert(waiting_.end(), session) : waiting_.end();
}

void Sessions::CloseAll() {
  std::vector<std::shared_ptr<SessionBase>> all;
  {
    absl::MutexLock lock(&mutex_);
    closed_ = true;
    for (const auto& [session, entry] : all_) {
      if (auto held = entry.session.lock(); held != nullptr) all.push_back(std::move(held));
    }
  }
  for (const auto& session : all) session->Close();
}

bool Sessions::TakeBytes(std::size_t bytes) {
  absl::MutexLock lock(&mutex_);
  if (bytes > most_bytes_ - bytes_) return false;
  bytes_ += bytes;
  return true;
}

void Sessions::GiveBytes(std::size_t bytes) {
  absl::MutexLock lock(&mutex_);
  bytes_ -= bytes;
}

std::size_t Sessions::count() const {
  absl::MutexLock lock(&mutex_);
  return all_.size();
}

std::uint64_t Sessions::refused() const {
  absl::MutexLock lock(&mutex_);
  return refused_;
}

}  // namespace strata::server::web
