// A request as it came: bytes that nobody has looked at yet.
#ifndef STRATA_SERVER_RPC_SEALED_H_
#define STRATA_SERVER_RPC_SEALED_H_

#include <grpcpp/impl/codegen/serialization_traits.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/status.h>

namespace strata::server {

// In place of `Message` in gRPC's handlers, so that gRPC parses nothing: Request::Open() does, once
// it is known who sent it.
template <typename Message>
struct Sealed {
  grpc::ByteBuffer bytes;
};

}  // namespace strata::server

namespace grpc {

template <typename Message>
class SerializationTraits<strata::server::Sealed<Message>> {
 public:
  // The caller lets go of what is left in `buffer` without freeing it.
  static Status Deserialize(ByteBuffer* buffer, strata::server::Sealed<Message>* sealed) {
    sealed->bytes.Clear();
    sealed->bytes.Swap(buffer);
    return Status::OK;
  }
};

}  // namespace grpc

#endif  // STRATA_SERVER_RPC_SEALED_H_
