// Classifiers of bare files: what `classifier train --data`, `evaluate --data` and `apply` do.
#ifndef STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_FILES_H_
#define STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_FILES_H_

#include <string>
#include <vector>

#include "absl/status/status.h"

#include "client/cli/terminal/command.h"
#include "core/world/job.h"

namespace strata::cli {

// Errors name the file, and are those of what is called.

struct FileTraining {
  std::vector<std::string> data;  // labelled scans, and folders of them
  std::string classes;            // as ReadLabelClasses(); empty: every label is a class
  std::string out;                // the classifier's file
  int folds = 0;                  // > 0: also scored by validation, whole files left out
  double region_m = 0.0;          // > 0: squares of this edge are left out instead
  JobParameters parameters;       // of the job "train", as it takes them
};
absl::Status TrainOnFiles(FileContext& context, const FileTraining& training);

struct FileEvaluation {
  std::string model;
  std::vector<std::string> data;  // labelled scans, and folders of them
  std::string classes;            // empty: labels are ids of the classifier's classes
  std::string picture;            // PNG; empty: none
};
absl::Status EvaluateOnFiles(FileContext& context, const FileEvaluation& evaluation);

struct FileLabelling {
  std::string model;
  std::string data;
  std::string out;  // .ply or .pcd
};
absl::Status LabelFile(FileContext& context, const FileLabelling& labelling);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_FILES_H_
