#include "server/web/contract.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <glog/logging.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/type_resolver_util.h>

namespace strata::server::web {
namespace {

namespace pb = google::protobuf;

constexpr char kTypePrefix[] = "type.googleapis.com";

std::string TypeOf(const pb::Descriptor& message) {
  return absl::StrCat(kTypePrefix, "/", message.full_name());
}

pb::StringPiece Piece(absl::string_view text) { return {text.data(), text.size()}; }

std::string Words(const pb::util::Status& status) {
  return {status.message().data(), status.message().size()};
}

}  // namespace

Contract::Contract(const std::vector<std::string>& services)
    : types_(pb::util::NewTypeResolverForDescriptorPool(kTypePrefix,
                                                        pb::DescriptorPool::generated_pool())) {
  for (const std::string& name : services) {
    const pb::ServiceDescriptor* service =
        pb::DescriptorPool::generated_pool()->FindServiceByName(name);
    CHECK(service != nullptr) << name << " is not linked in";
    services_.push_back(service);
    for (int i = 0; i < service->method_count(); ++i) {
      const pb::MethodDescriptor* method = service->method(i);
      methods_[absl::StrCat("/", name, "/", method->name())] = method;
    }
  }
}

const pb::MethodDescriptor* Contract::Find(absl::string_view path) const {
  const auto found = methods_.find(path);
  return found == methods_.end() ? nullptr : found->second;
}

absl::StatusOr<std::string> Contract::FromJson(const pb::Descriptor& message,
                                               absl::string_view json) const {
  std::string bytes;
  const pb::util::Status status =
      pb::util::JsonToBinaryString(types_.get(), TypeOf(message), Piece(json), &bytes);
  if (status.ok()) return bytes;
  return absl::InvalidArgumentError(
      absl::StrCat("the body is no ", message.full_name(), " in JSON: ", Words(status)));
}

absl::StatusOr<std::string> Contract::ToJson(const pb::Descriptor& message,
                                             absl::string_view bytes) const {
  pb::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string json;
  const pb::util::Status status = pb::util::BinaryToJsonString(
      types_.get(), TypeOf(message), std::string(bytes), &json, options);
  if (status.ok()) return json;
  return absl::InternalError(
      absl::StrCat("the answer is no ", message.full_name(), ": ", Words(status)));
}

}  // namespace strata::server::web
