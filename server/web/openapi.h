// The contract as OpenAPI 3.1, for tools that make clients and pages of it.
#ifndef STRATA_SERVER_WEB_OPENAPI_H_
#define STRATA_SERVER_WEB_OPENAPI_H_

#include <string>

#include "server/web/contract.h"

namespace strata::server::web {

// JSON: a POST for every method without a stream of requests, schemas of all messages they take and
// give, with names and comments as in the .proto, and the GET of tiles.
std::string OpenApiOf(const Contract& contract);

}  // namespace strata::server::web

#endif  // STRATA_SERVER_WEB_OPENAPI_H_
