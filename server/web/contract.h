// What of the contract is reached by HTTP: methods by path, and their messages as JSON.
#ifndef STRATA_SERVER_WEB_CONTRACT_H_
#define STRATA_SERVER_WEB_CONTRACT_H_

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/type_resolver.h>

namespace strata::server::web {

// Of the services that a server has; all else comes from their descriptors. Thread-safe.
class Contract {
 public:
  // `services`: full names, of code that is linked in.
  explicit Contract(const std::vector<std::string>& services);

  const std::vector<const google::protobuf::ServiceDescriptor*>& services() const {
    return services_;
  }
  // `path` as in "/strata.v1.Maps/Get"; null: there is none.
  const google::protobuf::MethodDescriptor* Find(absl::string_view path) const;

  // A message's bytes of its JSON, which has names as in the .proto or as ProtoJSON writes them.
  // INVALID_ARGUMENT naming the field that is wrong.
  absl::StatusOr<std::string> FromJson(const google::protobuf::Descriptor& message,
                                       absl::string_view json) const;
  // The reverse, with names as in the .proto. INTERNAL for bytes that are no such message.
  absl::StatusOr<std::string> ToJson(const google::protobuf::Descriptor& message,
                                     absl::string_view bytes) const;

 private:
  std::vector<const google::protobuf::ServiceDescriptor*> services_;
  std::map<std::string, const google::protobuf::MethodDescriptor*, std::less<>> methods_;
  std::unique_ptr<google::protobuf::util::TypeResolver> types_;
};

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_CONTRACT_H_
