// How good a classifier is, for people and for programs.
#ifndef STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_SCORES_H_
#define STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_SCORES_H_

#include <string>
#include <vector>

#include "client/cli/terminal/output.h"
#include "core/classification/evaluation.h"

namespace strata::cli {

// accuracy, mean_iou, per_class (name, precision, recall, iou, support; null where there is
// nothing to divide by), confusion (a row for each true class, a column for each class given, both
// in the order of per_class), points. REQUIRES: a name for each class.
Json ScoresJson(const ConfusionMatrix& confusion, const std::vector<std::string>& names);

// The same as text: the scores, a table of classes, the confusion as a table.
void PrintScores(const ConfusionMatrix& confusion,
                 const std::vector<std::string>& names,
                 Output& output);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_SCORES_H_
