// What the calling thread is to the system. Threads that it starts from then on take after it.
#ifndef STRATA_CORE_COMMON_THIS_THREAD_H_
#define STRATA_CORE_COMMON_THIS_THREAD_H_

namespace strata {

// Its name, as `top -H` shows it; at most 15 characters count.
void NameThisThread(const char* name);

// Lets others go first where processors are scarce: `steps` of niceness, in [0, 19], of which each
// leaves it about a fifth less beside a busy thread that has taken none. Does not matter on an idle
// machine.
void YieldThisThread(int steps);

}  // namespace strata

#endif  // STRATA_CORE_COMMON_THIS_THREAD_H_
