// What of a map a call is about, for the log.
#ifndef STRATA_SERVER_RPC_CALL_OBJECT_H_
#define STRATA_SERVER_RPC_CALL_OBJECT_H_

#include <string>

#include <google/protobuf/message.h>

namespace strata::server {

// As "run/7" of a scan, "3" of a job or a constraint, "rebuild" of a job that begins, the name of a
// profile or a classifier; empty where `message` names none. As long as the client likes.
std::string ObjectNamedIn(const google::protobuf::Message& message);

}  // namespace strata::server

#endif  // STRATA_SERVER_RPC_CALL_OBJECT_H_
