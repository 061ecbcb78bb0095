// Names of threads, as `top -H` shows them.
#ifndef STRATA_CORE_COMMON_THREAD_NAME_H_
#define STRATA_CORE_COMMON_THREAD_NAME_H_

namespace strata {

// Names the calling thread, and by that the threads it starts from now on; at most 15 characters
// count.
void NameThisThread(const char* name);

}  // namespace strata

#endif  // STRATA_CORE_COMMON_THREAD_NAME_H_
