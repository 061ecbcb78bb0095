// What a fuzzer says to a server: some calls, one after the other, and their messages.
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

struct RpcCall {
  const google::protobuf::MethodDescriptor* method = nullptr;
  std::vector<std::unique_ptr<google::protobuf::Message>> requests;
  bool cut = false;       // the client goes away instead of half-closing
  bool held = false;      // nor does it half-close before all other calls have ended
  bool parseable = true;  // false: some request was no message of the method

  // "/strata.v1.Maps/Get".
  std::string path() const;
};

RpcCall CopyOf(const RpcCall& call);

using RpcScript = std::vector<RpcCall>;

std::unique_ptr<google::protobuf::Message> NewRequest(
    const google::protobuf::MethodDescriptor& method);

// Of each call: which method (16 bits of its path's hash, so that new methods leave recorded
// scripts as they are), whether it is cut or held and its number of requests (8 bits), then each
// request behind its length (16 bits). What is cut short counts.
RpcScript ReadScript(const std::uint8_t* data, std::size_t size);
// At most `most` bytes; calls that do not fit are left out.
std::string WriteScript(const RpcScript& script, std::size_t most);
// Another call, fewer, a change inside of one, or one again.
void MutateScript(RpcScript& script, std::minstd_rand& random);

}  // namespace strata::fuzz

#endif  // STRATA_TESTS_FUZZ_RPC_SCRIPT_H_
