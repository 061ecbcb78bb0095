// Which labels of files are which class: "ground=1200,1202;facade=1400,1401".
#ifndef STRATA_CLIENT_CLI_CLASSIFIER_LABEL_CLASSES_H_
#define STRATA_CLIENT_CLI_CLASSIFIER_LABEL_CLASSES_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/api/maps.h"
#include "core/classification/classifier.h"
#include "core/cloud/point_cloud.h"

namespace strata::cli {

struct LabelClasses {
  std::vector<ClassName> classes;
  std::map<std::uint16_t, std::uint16_t> class_of_label;  // ids of classes; labels of no class not

  // Labels become ids of classes; those of no class become 0.
  void Apply(PointCloud& cloud) const;
};

// Classes by ';' or line, each "name=label,label…"; what follows '#' in a line is not read. Ids are
// 1, 2, … in the order of the classes. INVALID_ARGUMENT naming the class: no name or one that is
// there twice, a label outside 1–65535 or given to two classes, no class at all.
absl::StatusOr<LabelClasses> ParseLabelClasses(absl::string_view text);

// The text itself where it has a '=', else that of the file which it names.
absl::StatusOr<LabelClasses> ReadLabelClasses(const std::string& text_or_file);

// Every label of the clouds but 0 is a class of its own, with itself as id and name.
LabelClasses EveryLabel(const std::vector<PointCloud>& clouds);

// The same labels for the ids that `classes` have: those of the same name. INVALID_ARGUMENT for a
// name that is not among them.
absl::StatusOr<LabelClasses> ForClassesOf(const LabelClasses& labels,
                                          const std::vector<ClassName>& classes);

// The same for the classes of a map; those that it does not have become its classes.
absl::StatusOr<LabelClasses> ForClassesOfMap(api::Maps& maps,
                                             const api::Call& call,
                                             const std::string& map,
                                             const LabelClasses& labels);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_CLASSIFIER_LABEL_CLASSES_H_
