// A robot that is followed between the core's words and the wire's.
#ifndef STRATA_PROTO_TRANSLATE_TRACK_H_
#define STRATA_PROTO_TRANSLATE_TRACK_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/world/tracking.h"
#include "strata/v1/posegraph.pb.h"

namespace strata::translate {

v1::TrackStart ToProto(absl::string_view map, const TrackStart& start);
// Everything of `step` but its points.
v1::TrackStep ToProto(const TrackStep& step);
v1::TrackResponse ToProto(const TrackedPose& pose);

// INVALID_ARGUMENT also for what ValidateTrackStart refuses.
absl::StatusOr<TrackStart> FromProto(const v1::TrackStart& start);
// A step without points and their grid; INVALID_ARGUMENT also for what ValidateTrackMotion refuses,
// and for a grid that does not hold as many points as announced.
absl::StatusOr<TrackStep> FromProto(const v1::TrackStep& step);
absl::StatusOr<TrackedPose> FromProto(const v1::TrackResponse& pose);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_TRACK_H_
