// What every call of the database carries beside its request.
#ifndef STRATA_CORE_API_CALL_H_
#define STRATA_CORE_API_CALL_H_

#include <string>

#include "core/common/stop.h"

namespace strata::api {

// A default-constructed call never expires and has no name.
struct Call {
  Stop stop;               // deadline and cancellation, honoured inside long work
  std::string request_id;  // appears in the log
  std::string principal;   // who asks; empty on a trusted path
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_CALL_H_
