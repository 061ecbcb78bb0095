// A classifier as bytes: one file that can be exported, kept and imported again.
#ifndef STRATA_CORE_CLASSIFICATION_CLASSIFIER_CODEC_H_
#define STRATA_CORE_CLASSIFICATION_CLASSIFIER_CODEC_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/classification/classifier.h"

namespace strata {

std::string EncodeClassifier(const Classifier& classifier);

// Checks everything: DATA_LOSS or UNIMPLEMENTED as OpenBlob() has them, DATA_LOSS naming what does
// not fit together, is not finite or is out of range. What is returned can be used by Classify().
absl::StatusOr<Classifier> DecodeClassifier(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_CLASSIFIER_CODEC_H_
