// Classifiers in and out of a map's store.
#ifndef STRATA_CORE_ENGINE_LABELS_CLASSIFIER_STORE_H_
#define STRATA_CORE_ENGINE_LABELS_CLASSIFIER_STORE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/classification/classifier.h"
#include "core/engine/map/map_core.h"
#include "core/storage/storage.h"
#include "core/world/classifier_info.h"

namespace strata {

// NOT_FOUND listing those there are.
absl::StatusOr<ClassifierInfo> FindClassifier(StorageReader& reader, absl::string_view name);

struct StoredClassifier {
  ClassifierInfo info;
  Classifier classifier;
};
// NOT_FOUND; DATA_LOSS if its bytes are damaged.
absl::StatusOr<StoredClassifier> LoadClassifier(StorageReader& reader, absl::string_view name);
absl::StatusOr<StoredClassifier> LoadClassifier(MapCore& core, absl::string_view name);

// "1=ground,2=wall", as in ClassifierInfo::parameters.
std::string ClassesText(const std::vector<ClassName>& classes);

// Stores it, durably, under info.name; the rest of what is known of it comes from both. Errors as
// of api::Classifiers::Import.
absl::StatusOr<ClassifierInfo> StoreClassifier(MapCore& core,
                                               ClassifierInfo info,
                                               const Classifier& classifier);

// The same, inside a commit, for one from elsewhere: its classes become those of the map by name,
// and are added to the map's table where they are not in it. `info`: what is known of it then.
absl::Status AdoptClassifier(StorageWriter& writer, Classifier classifier, ClassifierInfo& info);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_LABELS_CLASSIFIER_STORE_H_
