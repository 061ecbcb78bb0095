// Calls that a server with the small world (small_world.h) would grant, for a fuzzer to begin with.
#ifndef STRATA_TESTS_FUZZ_RPC_EXAMPLES_H_
#define STRATA_TESTS_FUZZ_RPC_EXAMPLES_H_

#include <random>

#include "tests/fuzz/rpc_script.h"

namespace strata::fuzz {

// A call of any method.
RpcCall AnyExample(std::minstd_rand& random);

// Calls of which each needs what those before it did.
RpcScript AnyStory(std::minstd_rand& random);

// An earlier try of the same stream, broken off or still open, of which only some requests came;
// now and then with another header. Of a resumable upload `call` then has only what was not sent.
// REQUIRES: `call` has a request.
RpcCall BreakOff(RpcCall& call, std::minstd_rand& random);

// Where `call` uploads scans, makes every scan's announced number of points, and its hash if it has
// one, those of its chunks. Scans that cannot be translated stay as they are.
void Announce(RpcCall& call);

}  // namespace strata::fuzz

#endif  // STRATA_TESTS_FUZZ_RPC_EXAMPLES_H_
