// What FilterLog refuses. Internal to core/egomotion, not installed.
#ifndef STRATA_CORE_EGOMOTION_LOG_CHECKS_H_
#define STRATA_CORE_EGOMOTION_LOG_CHECKS_H_

#include "absl/status/status.h"

#include "core/egomotion/motion_log.h"

namespace strata {

absl::Status ValidateLog(const MotionLog& log);

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_LOG_CHECKS_H_
