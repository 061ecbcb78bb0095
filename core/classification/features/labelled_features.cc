#include "core/classification/features/labelled_features.h"

#include "absl/strings/str_cat.h"

namespace strata {
namespace {

constexpr std::size_t kMaxClasses = 1000;

}  // namespace

absl::Status Validate(const LabelledFeatures& data) {
  if (data.labels.empty() || data.features.cols() == 0) {
    return absl::InvalidArgumentError("training: no labelled points");
  }
  if (static_cast<std::size_t>(data.features.rows()) != data.labels.size()) {
    return absl::InvalidArgumentError(absl::StrCat("training: ",
                                                   data.features.rows(),
                                                   " rows of features for ",
                                                   data.labels.size(),
                                                   " labels"));
  }
  if (data.classes < 2 || data.classes > kMaxClasses) {
    return absl::InvalidArgumentError(
        absl::StrCat("training: ", data.classes, " classes, must be in [2, ", kMaxClasses, "]"));
  }
  std::vector<std::size_t> count(data.classes, 0);
  for (const ClassIndex label : data.labels) {
    if (label >= data.classes) {
      return absl::InvalidArgumentError(
          absl::StrCat("training: label ", label, " is none of ", data.classes, " classes"));
    }
    ++count[label];
  }
  for (std::size_t k = 0; k < count.size(); ++k) {
    if (count[k] == 0) {
      return absl::InvalidArgumentError(absl::StrCat("training: class ", k, " has no points"));
    }
  }
  if (!data.features.allFinite()) {
    return absl::InvalidArgumentError("training: a feature is not finite");
  }
  return absl::OkStatus();
}

std::vector<ClassIndex> LargestScores(const ScoreMatrix& scores) {
  std::vector<ClassIndex> labels(static_cast<std::size_t>(scores.rows()));
  for (std::size_t i = 0; i < labels.size(); ++i) {
    Eigen::Index best = 0;
    scores.row(static_cast<Eigen::Index>(i)).maxCoeff(&best);
    labels[i] = static_cast<ClassIndex>(best);
  }
  return labels;
}

}  // namespace strata
