// Loops over several threads.
#ifndef STRATA_CORE_ENGINE_MAP_PARALLEL_H_
#define STRATA_CORE_ENGINE_MAP_PARALLEL_H_

#include <cstddef>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"

namespace strata {

// Calls body(thread, i) for every i in [0, count) from `threads` threads numbered from 0, each i
// once, in no order. The first error (that of the smallest i, if several) ends the loop early and
// is returned; an allocation that fails is RESOURCE_EXHAUSTED. Where the system has no more threads
// to give, fewer do it all.
absl::Status ParallelFor(int threads,
                         std::size_t count,
                         absl::FunctionRef<absl::Status(int thread, std::size_t i)> body);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_PARALLEL_H_
