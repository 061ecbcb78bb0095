#include "core/engine/labels/classifier_store.h"

#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"

#include "core/classification/classifier_codec.h"
#include "core/common/status.h"
#include "core/world/map_class.h"
#include "core/world/names.h"

namespace strata {
namespace {

absl::Status CheckSize(const ClassifierInfo& info, std::uint64_t bytes) {
  if (bytes <= kMaxClassifierBytes) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("classifier ",
                                                   info.name,
                                                   ": ",
                                                   bytes,
                                                   " bytes, at most ",
                                                   kMaxClassifierBytes,
                                                   "; reduce the points it learns from"));
}

// Writes it, inside a commit.
absl::Status Put(StorageWriter& writer, const Classifier& classifier, ClassifierInfo& info) {
  const std::string bytes = EncodeClassifier(classifier);
  STRATA_RETURN_IF_ERROR(CheckSize(info, bytes.size()));
  info.bytes = bytes.size();
  info.parameters["classes"] = ClassesText(classifier.classes);
  info.created = absl::FromUnixMicros(absl::ToUnixMicros(absl::Now()));
  STRATA_ASSIGN_OR_RETURN(info.id, writer.PutClassifier(info, bytes));
  return absl::OkStatus();
}

// Gives the classes the map's ids. Inside a commit.
absl::Status MatchClasses(StorageWriter& writer, std::vector<ClassName>& classes) {
  STRATA_ASSIGN_OR_RETURN(std::vector<MapClass> table, writer.reader().ListClasses());
  const std::size_t known = table.size();
  std::set<std::uint16_t> taken;
  for (ClassName& name : classes) {
    STRATA_ASSIGN_OR_RETURN(name.id, IdInTable(table, name.name, name.id));
    if (!taken.insert(name.id).second) {
      return absl::InvalidArgumentError(
          absl::StrCat("classifier: two of its classes are called ", name.name));
    }
  }
  for (std::size_t i = known; i < table.size(); ++i) {
    STRATA_RETURN_IF_ERROR(writer.PutClass(table[i]));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ClassifierInfo> FindClassifier(StorageReader& reader, absl::string_view name) {
  STRATA_RETURN_IF_ERROR(ValidateName("classifier name", name));
  STRATA_ASSIGN_OR_RETURN(const std::vector<ClassifierInfo> all, reader.ListClassifiers());
  std::vector<std::string> names;
  for (const ClassifierInfo& info : all) {
    if (info.name == name) return info;
    names.push_back(info.name);
  }
  return absl::NotFoundError(absl::StrCat("classifier ",
                                          name,
                                          " does not exist; there is ",
                                          names.empty() ? "none" : absl::StrJoin(names, ", ")));
}

absl::StatusOr<StoredClassifier> LoadClassifier(StorageReader& reader, absl::string_view name) {
  StoredClassifier stored;
  STRATA_ASSIGN_OR_RETURN(stored.info, FindClassifier(reader, name));
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, reader.GetClassifier(stored.info.id));
  absl::StatusOr<Classifier> classifier = DecodeClassifier(bytes);
  if (!classifier.ok()) {
    return Annotate(classifier.status(), absl::StrCat("classifier ", stored.info.name));
  }
  stored.classifier = *std::move(classifier);
  return stored;
}

absl::StatusOr<StoredClassifier> LoadClassifier(MapCore& core, absl::string_view name) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  return LoadClassifier(*reader, name);
}

std::string ClassesText(const std::vector<ClassName>& classes) {
  return absl::StrJoin(classes, ",", [](std::string* out, const ClassName& name) {
    absl::StrAppend(out, name.id, "=", name.name);
  });
}

absl::StatusOr<ClassifierInfo> StoreClassifier(MapCore& core,
                                               ClassifierInfo info,
                                               const Classifier& classifier) {
  STRATA_RETURN_IF_ERROR(
      core.writer().Run(Durability::kFull, 0, Stop(), [&](StorageWriter& writer) {
        return Put(writer, classifier, info);
      }));
  return info;
}

absl::Status AdoptClassifier(StorageWriter& writer, Classifier classifier, ClassifierInfo& info) {
  STRATA_RETURN_IF_ERROR(MatchClasses(writer, classifier.classes));
  return Put(writer, classifier, info);
}

}  // namespace strata
