// What the .proto files say about their messages, fields and methods.
#ifndef STRATA_SERVER_WEB_COMMENTS_H_
#define STRATA_SERVER_WEB_COMMENTS_H_

#include <cstddef>
#include <string>

#include <google/protobuf/descriptor.h>

namespace strata::server::web {

// A FileDescriptorSet of the contract, with its comments; made by the build.
extern const unsigned char kContractBytes[];
extern const std::size_t kContractSize;

// Thread-safe once it is made.
class Comments {
 public:
  Comments();
  // In one line, as it stands before the declaration in its file; empty where there is none.
  std::string Of(const google::protobuf::Descriptor& message) const;
  std::string Of(const google::protobuf::FieldDescriptor& field) const;
  std::string Of(const google::protobuf::EnumDescriptor& enumeration) const;
  std::string Of(const google::protobuf::EnumValueDescriptor& value) const;
  std::string Of(const google::protobuf::MethodDescriptor& method) const;
  std::string Of(const google::protobuf::ServiceDescriptor& service) const;

 private:
  google::protobuf::DescriptorPool pool_;
};

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_COMMENTS_H_
