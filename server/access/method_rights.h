// What each call needs: the one table.
#ifndef STRATA_SERVER_ACCESS_METHOD_RIGHTS_H_
#define STRATA_SERVER_ACCESS_METHOD_RIGHTS_H_

#include <optional>
#include <string>

#include "absl/strings/string_view.h"
#include <google/protobuf/message.h>

#include "server/access/right.h"

namespace strata::server {

struct MethodRight {
  absl::string_view method;  // as in "Maps.Create"
  Right right = Right::kAdmin;
  // Where a message names the map, as in "start.map". Empty: the call is of no map; anyone who is
  // known may call it, and its answer must hold nothing that he may not read.
  absl::string_view map_field;
};

// Null for a method that the table does not have: nobody may call it.
const MethodRight* FindMethodRight(absl::string_view method);

// The map that `message` names at `field`; nullopt where a message on the way is not set (a later
// message of a stream) or there is no such field.
std::optional<std::string> MapNamedIn(const google::protobuf::Message& message,
                                      absl::string_view field);

}  // namespace strata::server

#endif  // STRATA_SERVER_ACCESS_METHOD_RIGHTS_H_
