#include "tests/fuzz/rpc_script.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/codec/bytes.h"
#include "core/common/checksum.h"
#include "strata/v1/classifiers.pb.h"
#include "strata/v1/jobs.pb.h"
#include "strata/v1/maps.pb.h"
#include "strata/v1/planning.pb.h"
#include "strata/v1/posegraph.pb.h"
#include "strata/v1/scans.pb.h"
#include "strata/v1/tiles.pb.h"
#include "tests/fuzz/proto_mutator.h"
#include "tests/fuzz/rpc_examples.h"

namespace strata::fuzz {
namespace {

using google::protobuf::Message;
using google::protobuf::MethodDescriptor;

constexpr std::size_t kMostCalls = 6;
constexpr std::size_t kMostRequests = 8;
constexpr std::uint8_t kCut = 0x80;
constexpr std::uint8_t kHeld = 0x40;

std::vector<const MethodDescriptor*> FindMethods() {
  const std::array files = {v1::CreateMapRequest::descriptor()->file(),
                            v1::ScanHeader::descriptor()->file(),
                            v1::EncodedTile::descriptor()->file(),
                            v1::PlanPathRequest::descriptor()->file(),
                            v1::Job::descriptor()->file(),
                            v1::PoseNode::descriptor()->file(),
                            v1::Classifier::descriptor()->file()};
  std::vector<const MethodDescriptor*> methods;
  for (const google::protobuf::FileDescriptor* file : files) {
    for (int i = 0; i < file->service(0)->method_count(); ++i) {
      methods.push_back(file->service(0)->method(i));
    }
  }
  return methods;
}

std::uint16_t KeyOf(const MethodDescriptor& method) {
  return static_cast<std::uint16_t>(Checksum64(method.full_name()));
}

const MethodDescriptor* MethodOf(std::uint16_t key) {
  const auto& methods = AllMethods();
  const auto found = std::find_if(
      methods.begin(), methods.end(), [&](const auto* method) { return KeyOf(*method) == key; });
  return found != methods.end() ? *found : methods[key % methods.size()];
}

RpcCall ReadCall(ByteReader& reader) {
  RpcCall call;
  call.method = MethodOf(reader.Fixed<std::uint16_t>());
  const auto shape = reader.Fixed<std::uint8_t>();
  call.cut = (shape & kCut) != 0;
  call.held = (shape & kHeld) != 0 && call.method->client_streaming();
  const std::size_t requests = std::min<std::size_t>(shape & ~(kCut | kHeld), kMostRequests);
  while (reader.remaining() > 0 && call.requests.size() < requests) {
    const std::size_t length = reader.Fixed<std::uint16_t>();
    const absl::string_view bytes = reader.Take(std::min(length, reader.remaining()));
    call.requests.push_back(NewRequest(*call.method));
    call.parseable &=
        call.requests.back()->ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
  }
  return call;
}

std::string WriteCall(const RpcCall& call) {
  std::string bodies;
  auto shape = static_cast<std::uint8_t>((call.cut ? kCut : 0) | (call.held ? kHeld : 0));
  for (const std::unique_ptr<Message>& request : call.requests) {
    const std::string body = request->SerializePartialAsString();
    if (body.size() > UINT16_MAX) continue;
    ++shape;
    PutFixed(bodies, static_cast<std::uint16_t>(body.size()));
    bodies += body;
  }
  std::string bytes;
  PutFixed(bytes, KeyOf(*call.method));
  PutFixed(bytes, shape);
  return bytes + bodies;
}

void MutateCall(RpcCall& call, std::minstd_rand& random) {
  auto& requests = call.requests;
  const bool one = requests.size() == 1 && !call.method->client_streaming();
  if (random() % 16 == 0) call.cut = !call.cut;
  if (call.method->client_streaming() && random() % 4 == 0) call.held = !call.held;
  if (requests.empty() || (!one && requests.size() < kMostRequests && random() % 8 == 0)) {
    requests.push_back(NewRequest(*call.method));
  } else if (!one && random() % 16 == 0) {
    requests.pop_back();
    if (requests.empty()) return;
  } else if (requests.size() > 1 && random() % 16 == 0) {
    std::swap(requests[random() % requests.size()], requests[random() % requests.size()]);
  }
  Mutate(*requests[random() % requests.size()], random);
  if (random() % 2 == 0) Announce(call);
}

}  // namespace

const std::vector<const MethodDescriptor*>& AllMethods() {
  static const auto* const methods = new std::vector<const MethodDescriptor*>(FindMethods());
  return *methods;
}

std::unique_ptr<Message> NewRequest(const MethodDescriptor& method) {
  return std::unique_ptr<Message>(google::protobuf::MessageFactory::generated_factory()
                                      ->GetPrototype(method.input_type())
                                      ->New());
}

RpcCall CopyOf(const RpcCall& call) {
  RpcCall copy{.method = call.method, .requests = {}, .cut = call.cut, .held = call.held};
  for (const std::unique_ptr<Message>& request : call.requests) {
    copy.requests.push_back(NewRequest(*call.method));
    copy.requests.back()->CopyFrom(*request);
  }
  return copy;
}

std::string RpcCall::path() const {
  return absl::StrCat("/", method->service()->full_name(), "/", method->name());
}

RpcScript ReadScript(const std::uint8_t* data, std::size_t size) {
  ByteReader reader(absl::string_view(reinterpret_cast<const char*>(data), size));
  RpcScript script;
  while (reader.remaining() > 0 && script.size() < kMostCalls) script.push_back(ReadCall(reader));
  return script;
}

std::string WriteScript(const RpcScript& script, std::size_t most) {
  std::string bytes;
  for (const RpcCall& call : script) {
    const std::string next = WriteCall(call);
    if (bytes.size() + next.size() <= most) bytes += next;
  }
  return bytes;
}

void MutateScript(RpcScript& script, std::minstd_rand& random) {
  if (script.empty() && random() % 2 == 0) {
    script = AnyStory(random);
    return;
  }
  const auto place = [&] { return static_cast<std::ptrdiff_t>(random() % script.size()); };
  const unsigned what = script.empty() ? 0 : random() % 16;
  if (what < 3 && script.size() < kMostCalls) {
    const auto at = script.empty() ? 0 : place();
    script.insert(script.begin() + at, AnyExample(random));
  } else if (what == 3 && script.size() < kMostCalls) {
    script.push_back(CopyOf(script[static_cast<std::size_t>(place())]));
  } else if (what == 6 && script.size() < kMostCalls) {
    const auto at = place();
    RpcCall& call = script[static_cast<std::size_t>(at)];
    if (call.requests.empty()) return;
    script.insert(script.begin() + at, BreakOff(call, random));
  } else if (what == 4 && script.size() > 1) {
    script.erase(script.begin() + place());
  } else if (what == 5) {
    std::swap(script[static_cast<std::size_t>(place())], script[static_cast<std::size_t>(place())]);
  } else {
    MutateCall(script[static_cast<std::size_t>(place())], random);
  }
}

}  // namespace strata::fuzz
