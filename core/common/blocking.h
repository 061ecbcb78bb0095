// Threads that are lent out say when they wait, so that others run meanwhile.
#ifndef STRATA_CORE_COMMON_BLOCKING_H_
#define STRATA_CORE_COMMON_BLOCKING_H_

namespace strata {

// Whoever lends a thread out. Called on that thread; must not throw, since waits end in
// destructors.
class BlockingObserver {
 public:
  virtual ~BlockingObserver() = default;
  virtual void BlockingBegins() = 0;
  // `in_turn`: as of BlockingScope.
  virtual void BlockingEnds(bool in_turn) = 0;
};

// Who hears of the calling thread's waits; nullptr: nobody, as at first.
void SetBlockingObserver(BlockingObserver* observer);

// The calling thread waits for another one, or for a client, as long as this lives. Inside another
// one: nothing.
class BlockingScope {
 public:
  // `in_turn`: the end waits until it is this thread's turn to run, which may take as long as a
  // call; so no mutex may be held. Otherwise it goes on at once, even where too many run then: for
  // those that have little left to do.
  explicit BlockingScope(bool in_turn = false);
  ~BlockingScope();
  BlockingScope(const BlockingScope&) = delete;
  BlockingScope& operator=(const BlockingScope&) = delete;

 private:
  const bool in_turn_;
  BlockingObserver* const observer_;
};

}  // namespace strata

#endif  // STRATA_CORE_COMMON_BLOCKING_H_
