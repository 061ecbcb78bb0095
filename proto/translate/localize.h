// The search for the place of a scan between the core's words and the wire's.
#ifndef STRATA_PROTO_TRANSLATE_LOCALIZE_H_
#define STRATA_PROTO_TRANSLATE_LOCALIZE_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/world/localization.h"
#include "strata/v1/posegraph.pb.h"

namespace strata::translate {

// Everything of `query` but its points.
v1::LocalizeStart ToProto(absl::string_view map, const LocalizeQuery& query);
v1::LocalizeResponse ToProto(const LocalizeResult& result);

// A query without points; INVALID_ARGUMENT also for a guess that ValidateLocalizeGuess refuses and
// for a grid that does not hold as many points as announced.
absl::StatusOr<LocalizeQuery> FromProto(const v1::LocalizeStart& start);
absl::StatusOr<LocalizeResult> FromProto(const v1::LocalizeResponse& result);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_LOCALIZE_H_
