// The options of `classifier train`, on a map and on bare files.
#ifndef STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_OPTIONS_H_
#define STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_OPTIONS_H_

#include <CLI/CLI.hpp>

#include "core/classification/classifier.h"

namespace strata::cli {

// --method, --features, --reduce, --neighbours. Written to `options` while the command line is
// parsed.
void AddTrainingOptions(CLI::App* verb, TrainingOptions& options);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_OPTIONS_H_
