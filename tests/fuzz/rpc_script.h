// What a fuzzer says to a server: one call and its messages.
#ifndef STRATA_TESTS_FUZZ_RPC_SCRIPT_H_
#define STRATA_TESTS_FUZZ_RPC_SCRIPT_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

namespace strata::fuzz {

// Every call of every service of the contract, in the contract's order.
const std::vector<const google::protobuf::MethodDescriptor*>& AllMethods();

struct RpcScript {
  const google::protobuf::MethodDescriptor* method = nullptr;
  std::vector<std::unique_ptr<google::protobuf::Message>> requests;
  bool parseable = true;  // false: some request was no message of the method

  // "/strata.v1.Maps/Get".
  std::string path() const;
};

// A byte for the method, then each request behind its length (16 bits); what is cut short counts.
RpcScript ReadScript(const std::uint8_t* data, std::size_t size);
// At most `most` bytes; requests that do not fit are left out.
std::string WriteScript(const RpcScript& script, std::size_t most);
// Another request, fewer, a change inside of one, or another method.
void MutateScript(RpcScript& script, std::minstd_rand& random);

}  // namespace strata::fuzz

#endif  // STRATA_TESTS_FUZZ_RPC_SCRIPT_H_
