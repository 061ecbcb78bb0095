#include "core/engine/doors/classifiers.h"

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

#include "core/classification/classifier_codec.h"
#include "core/common/status.h"
#include "core/engine/doors/map_reading.h"
#include "core/engine/labels/classifier_store.h"
#include "core/world/names.h"

namespace strata {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

}  // namespace

absl::StatusOr<ClassifierInfo> EngineClassifiers::Get(const api::Call& call,
                                                      absl::string_view map,
                                                      absl::string_view name) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  ClassifierInfo info;
  STRATA_RETURN_IF_ERROR(found.ReadState([&](StorageReader& reader, const MapClock&) {
    return AssignTo(FindClassifier(reader, name), info);
  }));
  return info;
}

absl::StatusOr<std::vector<ClassifierInfo>> EngineClassifiers::List(const api::Call& call,
                                                                    absl::string_view map) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  std::vector<ClassifierInfo> all;
  STRATA_RETURN_IF_ERROR(found.ReadState([&](StorageReader& reader, const MapClock&) {
    return AssignTo(reader.ListClassifiers(), all);
  }));
  return all;
}

absl::Status EngineClassifiers::Delete(const api::Call& call,
                                       absl::string_view map,
                                       absl::string_view name) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  return place.Commit(call.stop, [&](StorageWriter& writer) -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(const ClassifierInfo info, FindClassifier(writer.reader(), name));
    return writer.DeleteClassifier(info.id);
  });
}

absl::Status EngineClassifiers::Export(const api::Call& call,
                                       absl::string_view map,
                                       absl::string_view name,
                                       absl::FunctionRef<absl::Status(absl::string_view)> sink) {
  STRATA_ASSIGN_OR_RETURN(const MapReading found, maps_.FindToRead(call, map));
  // What leaves can be read: nobody else would find out.
  StoredClassifier stored;
  STRATA_RETURN_IF_ERROR(found.ReadState([&](StorageReader& reader, const MapClock&) {
    return AssignTo(LoadClassifier(reader, name), stored);
  }));
  const std::string bytes = EncodeClassifier(stored.classifier);
  const absl::string_view all = bytes;
  for (std::size_t begin = 0; begin < all.size(); begin += kPieceBytes) {
    STRATA_RETURN_IF_ERROR(call.stop.status());
    STRATA_RETURN_IF_ERROR(sink(all.substr(begin, kPieceBytes)));
  }
  return absl::OkStatus();
}

absl::StatusOr<ClassifierInfo> EngineClassifiers::Import(const api::Call& call,
                                                         absl::string_view map,
                                                         absl::string_view name,
                                                         absl::string_view bytes) {
  STRATA_RETURN_IF_ERROR(call.stop.status());
  STRATA_ASSIGN_OR_RETURN(const EngineMaps::Place place, maps_.FindToAdd(call.stop, map));
  STRATA_RETURN_IF_ERROR(ValidateName("classifier name", name));
  ClassifierInfo info;
  info.name = std::string(name);
  if (bytes.size() > kMaxClassifierBytes) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "classifier ", name, ": ", bytes.size(), " bytes, at most ", kMaxClassifierBytes));
  }
  absl::StatusOr<Classifier> classifier = DecodeClassifier(bytes);
  if (!classifier.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat("classifier ", name, ": ", classifier.status().message()));
  }
  info.description = "imported";
  info.parameters = {{"method", std::string(ToString(classifier->method))},
                     {"features", std::string(ToString(classifier->features.set))}};
  STRATA_RETURN_IF_ERROR(place.Commit(call.stop, [&](StorageWriter& writer) {
    return AdoptClassifier(writer, *classifier, info);
  }));
  return info;
}

}  // namespace strata
