#include "tests/fuzz/rpc_script.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/codec/bytes.h"
#include "strata/v1/classifiers.pb.h"
#include "strata/v1/jobs.pb.h"
#include "strata/v1/maps.pb.h"
#include "strata/v1/planning.pb.h"
#include "strata/v1/posegraph.pb.h"
#include "strata/v1/scans.pb.h"
#include "strata/v1/tiles.pb.h"
#include "tests/fuzz/proto_mutator.h"

namespace strata::fuzz {
namespace {

using google::protobuf::Message;
using google::protobuf::MethodDescriptor;

constexpr std::size_t kMostRequests = 8;

std::unique_ptr<Message> NewRequest(const MethodDescriptor& method) {
  return std::unique_ptr<Message>(google::protobuf::MessageFactory::generated_factory()
                                      ->GetPrototype(method.input_type())
                                      ->New());
}

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

}  // namespace

const std::vector<const MethodDescriptor*>& AllMethods() {
  static const auto* const methods = new std::vector<const MethodDescriptor*>(FindMethods());
  return *methods;
}

std::string RpcScript::path() const {
  return absl::StrCat("/", method->service()->full_name(), "/", method->name());
}

RpcScript ReadScript(const std::uint8_t* data, std::size_t size) {
  ByteReader reader(absl::string_view(reinterpret_cast<const char*>(data), size));
  RpcScript script;
  script.method = AllMethods()[reader.Fixed<std::uint8_t>() % AllMethods().size()];
  while (reader.remaining() > 0 && script.requests.size() < kMostRequests) {
    const std::size_t length = reader.Fixed<std::uint16_t>();
    const absl::string_view bytes = reader.Take(std::min(length, reader.remaining()));
    script.requests.push_back(NewRequest(*script.method));
    script.parseable &=
        script.requests.back()->ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
  }
  return script;
}

std::string WriteScript(const RpcScript& script, std::size_t most) {
  const auto method = std::find(AllMethods().begin(), AllMethods().end(), script.method);
  std::string bytes(1, static_cast<char>(method - AllMethods().begin()));
  for (const std::unique_ptr<Message>& request : script.requests) {
    const std::string body = request->SerializePartialAsString();
    if (body.size() > UINT16_MAX || bytes.size() + 2 + body.size() > most) continue;
    PutFixed(bytes, static_cast<std::uint16_t>(body.size()));
    bytes += body;
  }
  return bytes;
}

void MutateScript(RpcScript& script, std::minstd_rand& random) {
  if (random() % 32 == 0) {
    script.method = AllMethods()[random() % AllMethods().size()];
    script.requests.clear();
  }
  auto& requests = script.requests;
  const bool one = requests.size() == 1 && !script.method->client_streaming();
  if (requests.empty() || (!one && requests.size() < kMostRequests && random() % 8 == 0)) {
    requests.push_back(NewRequest(*script.method));
  } else if (!one && random() % 16 == 0) {
    requests.pop_back();
    if (requests.empty()) return;
  } else if (requests.size() > 1 && random() % 16 == 0) {
    std::swap(requests[random() % requests.size()], requests[random() % requests.size()]);
  }
  Mutate(*requests[random() % requests.size()], random);
}

}  // namespace strata::fuzz
