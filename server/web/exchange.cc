#include "server/web/exchange.h"

#include <algorithm>
#include <cstdint>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

namespace strata::server::web {

Answer ErrorAnswer(const grpc::Status& status) {
  Answer answer{
      HttpStatusOf(status.error_code()), {{"Content-Type", "application/json"}}, ErrorJson(status)};
  if (status.error_code() == grpc::UNAUTHENTICATED) {
    answer.headers.emplace_back("WWW-Authenticate", "Bearer");
  }
  if (const std::optional<absl::Duration> delay = RetryDelayIn(status); delay.has_value()) {
    const std::int64_t seconds = absl::ToInt64Seconds(absl::Ceil(*delay, absl::Seconds(1)));
    answer.headers.emplace_back("Retry-After", absl::StrCat(std::max<std::int64_t>(seconds, 1)));
  }
  return answer;
}

Answer ErrorAnswer(int http_status, grpc::StatusCode code, const std::string& message) {
  Answer answer = ErrorAnswer(grpc::Status(code, message));
  answer.status = http_status;
  return answer;
}

}  // namespace strata::server::web
