// Classifiers between the core's words and the wire's.
#ifndef STRATA_PROTO_TRANSLATE_CLASSIFIERS_H_
#define STRATA_PROTO_TRANSLATE_CLASSIFIERS_H_

#include "absl/status/statusor.h"

#include "core/world/classifier_info.h"
#include "strata/v1/classifiers.pb.h"

namespace strata::translate {

v1::Classifier ToProto(const ClassifierInfo& info);
absl::StatusOr<ClassifierInfo> FromProto(const v1::Classifier& classifier);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_CLASSIFIERS_H_
