// How the last server on a data directory ended: by a fault of its own, or by somebody's hand.
#ifndef STRATA_SERVER_LAST_END_H_
#define STRATA_SERVER_LAST_END_H_

#include <filesystem>

namespace strata::server {

// Begins a run on `directory`: from now on a fault of this process (SIGSEGV, SIGBUS, SIGFPE,
// SIGILL, SIGABRT) is noted in its file `stratad.run`. True if the run before was noted and left no
// fault, and the kernel has killed no process of this machine for want of memory since: if it did
// not end well, somebody killed it, or the power failed. False where that cannot be told. Once a
// process, before it has threads.
bool BeginRun(const std::filesystem::path& directory);

}  // namespace strata::server

#endif  // STRATA_SERVER_LAST_END_H_
