#include "server/web/comments.h"

#include <string>

#include "absl/strings/ascii.h"
#include <google/protobuf/descriptor.pb.h>

namespace strata::server::web {
namespace {

namespace pb = google::protobuf;

template <typename Declaration>
std::string CommentBefore(const Declaration* declaration) {
  pb::SourceLocation location;
  if (declaration == nullptr || !declaration->GetSourceLocation(&location)) return {};
  std::string text = location.leading_comments;
  absl::RemoveExtraAsciiWhitespace(&text);
  return text;
}

}  // namespace

Comments::Comments() {
  pb::FileDescriptorSet files;
  files.ParseFromArray(kContractBytes, static_cast<int>(kContractSize));
  for (const pb::FileDescriptorProto& file : files.file()) pool_.BuildFile(file);
}

std::string Comments::Of(const pb::Descriptor& message) const {
  return CommentBefore(pool_.FindMessageTypeByName(message.full_name()));
}
std::string Comments::Of(const pb::FieldDescriptor& field) const {
  return CommentBefore(pool_.FindFieldByName(field.full_name()));
}
std::string Comments::Of(const pb::EnumDescriptor& enumeration) const {
  return CommentBefore(pool_.FindEnumTypeByName(enumeration.full_name()));
}
std::string Comments::Of(const pb::EnumValueDescriptor& value) const {
  return CommentBefore(pool_.FindEnumValueByName(value.full_name()));
}
std::string Comments::Of(const pb::MethodDescriptor& method) const {
  return CommentBefore(pool_.FindMethodByName(method.full_name()));
}
std::string Comments::Of(const pb::ServiceDescriptor& service) const {
  return CommentBefore(pool_.FindServiceByName(service.full_name()));
}

}  // namespace strata::server::web
