#include "server/rpc/call_object.h"

#include "absl/strings/str_cat.h"
#include <google/protobuf/descriptor.h>

namespace strata::server {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

// The field of `message` if it is set; else nullptr.
const FieldDescriptor* Set(const Message& message, const char* name) {
  const FieldDescriptor* const field = message.GetDescriptor()->FindFieldByName(name);
  if (field == nullptr || field->is_repeated()) return nullptr;
  return message.GetReflection()->HasField(message, field) ? field : nullptr;
}

std::string TextOf(const Message& message, const FieldDescriptor& field) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_STRING:
      return reflection.GetString(message, &field);
    case FieldDescriptor::CPPTYPE_UINT64:
      return absl::StrCat(reflection.GetUInt64(message, &field));
    case FieldDescriptor::CPPTYPE_MESSAGE: {
      const Message& id = reflection.GetMessage(message, &field);
      const FieldDescriptor* const trajectory = Set(id, "trajectory");
      const FieldDescriptor* const sequence = Set(id, "sequence");
      return absl::StrCat(trajectory == nullptr ? "" : TextOf(id, *trajectory),
                          "/",
                          sequence == nullptr ? "0" : TextOf(id, *sequence));
    }
    default:
      return "";
  }
}

}  // namespace

std::string ObjectNamedIn(const Message& message) {
  // Where requests keep what they are about, next to `map` or below these.
  for (const char* inner : {"start", "header"}) {
    const FieldDescriptor* const field = Set(message, inner);
    if (field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      return ObjectNamedIn(message.GetReflection()->GetMessage(message, field));
    }
  }
  // A message without `map` is about a map itself, and `name` is its name.
  const bool of_map = message.GetDescriptor()->FindFieldByName("map") == nullptr;
  for (const char* name : {"id", "kind", "name", "trajectory"}) {
    const FieldDescriptor* const field = Set(message, name);
    if (field == nullptr || (of_map && field->name() == "name")) continue;
    return TextOf(message, *field);
  }
  return "";
}

}  // namespace strata::server
