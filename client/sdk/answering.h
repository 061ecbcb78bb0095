// What there is at an address where no server answered.
#ifndef STRATA_CLIENT_SDK_ANSWERING_H_
#define STRATA_CLIENT_SDK_ANSWERING_H_

#include <string>

#include "core/common/host_port.h"

namespace strata::sdk {

// Says in half a sentence what is at `address`, and what to do about it: "nothing listens there; is
// stratad running?", "an HTTP server answers there (HTTP/1.1 400 Bad Request); …". `tls`: the
// caller spoke TLS. Takes a second at most, but for looking the name up. Thread-safe.
std::string WhatAnswers(const HostPort& address, bool tls);

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_ANSWERING_H_
