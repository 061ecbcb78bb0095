// A store that loses the answer to a commit: it took place or not, and its caller is told that
// nobody knows.
#ifndef STRATA_TESTS_SUPPORT_FAULTS_ANSWER_LOSS_H_
#define STRATA_TESTS_SUPPORT_FAULTS_ANSWER_LOSS_H_

#include <memory>
#include <optional>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

#include "core/engine/map/map_stores.h"
#include "core/storage/storage.h"

namespace strata::testing {

// Whose answers are lost. Thread-safe.
class AnswerLoss {
 public:
  // That of the commit after `commits` more.
  void LoseAfter(int commits, bool takes_place);
  // For one more commit: nullopt, or whether it takes place and its answer is lost.
  std::optional<bool> NextCommit();
  // All so far.
  int commits() const;
  bool lost() const;

 private:
  mutable absl::Mutex mutex_;
  int commits_ ABSL_GUARDED_BY(mutex_) = 0;
  int lost_at_ ABSL_GUARDED_BY(mutex_) = -1;
  bool takes_place_ ABSL_GUARDED_BY(mutex_) = false;
};

// `inner`, with answers lost as `loss`, which must outlive it, says.
std::unique_ptr<MapStorage> LoseAnswers(std::unique_ptr<MapStorage> inner, AnswerLoss& loss);
// The same of every map that is opened.
std::unique_ptr<MapStores> LoseAnswers(std::unique_ptr<MapStores> inner, AnswerLoss& loss);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_FAULTS_ANSWER_LOSS_H_
