// Calls by path and bytes, of services without generated code at hand.
#ifndef STRATA_TESTS_SERVER_RAW_CALL_H_
#define STRATA_TESTS_SERVER_RAW_CALL_H_

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <grpcpp/channel.h>
#include <grpcpp/support/status.h>

namespace strata::server {

struct RawAnswer {
  grpc::Status status;
  std::vector<std::string> messages;
};

// Sends one request and says that there are no more; the answers come within 10 seconds or the
// status is DEADLINE_EXCEEDED.
RawAnswer CallRaw(const std::shared_ptr<grpc::Channel>& channel,
                  const std::string& path,
                  const std::string& request,
                  const std::map<std::string, std::string>& metadata = {});

}  // namespace strata::server

#endif  // STRATA_TESTS_SERVER_RAW_CALL_H_
