#include "proto/translate/jobs.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "proto/translate/geometry.h"

namespace strata::translate {
namespace {

static_assert(v1::JOB_STATE_QUEUED == static_cast<int>(JobState::kQueued));
static_assert(v1::JOB_STATE_RUNNING == static_cast<int>(JobState::kRunning));
static_assert(v1::JOB_STATE_SUCCEEDED == static_cast<int>(JobState::kSucceeded));
static_assert(v1::JOB_STATE_FAILED == static_cast<int>(JobState::kFailed));
static_assert(v1::JOB_STATE_CANCELLED == static_cast<int>(JobState::kCancelled));
static_assert(v1::JOB_STATE_PROPOSED == static_cast<int>(JobState::kProposed));

}  // namespace

v1::Job ToProto(const JobInfo& job) {
  v1::Job proto;
  proto.set_id(job.id);
  proto.set_kind(job.kind);
  proto.mutable_parameters()->insert(job.parameters.begin(), job.parameters.end());
  proto.set_state(static_cast<v1::JobState>(job.state));
  proto.set_progress(job.progress);
  proto.set_phase(job.phase);
  proto.set_message(job.message);
  proto.mutable_metrics()->insert(job.metrics.begin(), job.metrics.end());
  *proto.mutable_created() = ToProto(job.created);
  *proto.mutable_updated() = ToProto(job.updated);
  return proto;
}

absl::StatusOr<JobInfo> FromProto(const v1::Job& proto) {
  if (!v1::JobState_IsValid(proto.state()) || proto.state() == v1::JOB_STATE_UNSPECIFIED) {
    return absl::InvalidArgumentError(absl::StrCat(
        "job ", proto.id(), ": state ", static_cast<int>(proto.state()), " is not known"));
  }
  JobInfo job;
  job.id = proto.id();
  job.kind = proto.kind();
  job.parameters.insert(proto.parameters().begin(), proto.parameters().end());
  job.state = static_cast<JobState>(proto.state());
  job.progress = proto.progress();
  job.phase = proto.phase();
  job.message = proto.message();
  job.metrics.insert(proto.metrics().begin(), proto.metrics().end());
  STRATA_ASSIGN_OR_RETURN(job.created, FromProto("created", proto.created()));
  STRATA_ASSIGN_OR_RETURN(job.updated, FromProto("updated", proto.updated()));
  return job;
}

}  // namespace strata::translate
