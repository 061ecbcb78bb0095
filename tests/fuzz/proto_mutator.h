// Small random changes of protobuf messages, so that a fuzzer's requests are ones that can be
// parsed.
#ifndef STRATA_TESTS_FUZZ_PROTO_MUTATOR_H_
#define STRATA_TESTS_FUZZ_PROTO_MUTATOR_H_

#include <random>

#include <google/protobuf/message.h>

namespace strata::fuzz {

// Sets, clears, adds or changes one field somewhere in `message`.
void Mutate(google::protobuf::Message& message, std::minstd_rand& random);

}  // namespace strata::fuzz

#endif  // STRATA_TESTS_FUZZ_PROTO_MUTATOR_H_
