// Classifiers of a map. Training and labelling are jobs: "train", "classify", "evaluate".
#ifndef STRATA_CORE_API_CLASSIFIERS_H_
#define STRATA_CORE_API_CLASSIFIERS_H_

#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/call.h"
#include "core/world/classifier_info.h"

namespace strata::api {

// Thread-safe. A classifier that is not there is NOT_FOUND.
class Classifiers {
 public:
  virtual ~Classifiers() = default;

  virtual absl::StatusOr<ClassifierInfo> Get(const Call& call,
                                             absl::string_view map,
                                             absl::string_view name) = 0;
  // By id.
  virtual absl::StatusOr<std::vector<ClassifierInfo>> List(const Call& call,
                                                           absl::string_view map) = 0;
  // Labels that it gave stay.
  virtual absl::Status Delete(const Call& call, absl::string_view map, absl::string_view name) = 0;
  // Its bytes (core/classification's classifier_codec.h reads them) in pieces of at most 1 MiB, in
  // order. DATA_LOSS if what is stored is damaged.
  virtual absl::Status Export(const Call& call,
                              absl::string_view map,
                              absl::string_view name,
                              absl::FunctionRef<absl::Status(absl::string_view)> sink) = 0;
  // Keeps a classifier that was exported, from this map or another. Its classes become those of the
  // map that have their names; names that the map has not are added to its table.
  // INVALID_ARGUMENT for a bad name and for bytes that are no classifier; ALREADY_EXISTS for the
  // name; RESOURCE_EXHAUSTED beyond kMaxClassifierBytes, and where no class id is left.
  virtual absl::StatusOr<ClassifierInfo> Import(const Call& call,
                                                absl::string_view map,
                                                absl::string_view name,
                                                absl::string_view bytes) = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_CLASSIFIERS_H_
