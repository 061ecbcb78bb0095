#include "core/common/blocking.h"

#include <utility>

namespace strata {
namespace {

thread_local BlockingObserver* observer_of_thread = nullptr;

}  // namespace

void SetBlockingObserver(BlockingObserver* observer) { observer_of_thread = observer; }

// Nobody is told of a wait inside a wait.
BlockingScope::BlockingScope(bool in_turn)
    : in_turn_(in_turn), observer_(std::exchange(observer_of_thread, nullptr)) {
  if (observer_ != nullptr) observer_->BlockingBegins();
}

BlockingScope::~BlockingScope() {
  if (observer_ == nullptr) return;
  observer_->BlockingEnds(in_turn_);
  observer_of_thread = observer_;
}

}  // namespace strata
