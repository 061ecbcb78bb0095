// Jobs between the core's words and the wire's.
#ifndef STRATA_PROTO_TRANSLATE_JOBS_H_
#define STRATA_PROTO_TRANSLATE_JOBS_H_

#include "absl/status/statusor.h"

#include "core/world/job.h"
#include "strata/v1/jobs.pb.h"

namespace strata::translate {

v1::Job ToProto(const JobInfo& job);
// INVALID_ARGUMENT for an unknown state or a bad time.
absl::StatusOr<JobInfo> FromProto(const v1::Job& job);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_JOBS_H_
