// The options of `classifier train`, on a map and on bare files.
#ifndef STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_OPTIONS_H_
#define STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_OPTIONS_H_

#include <CLI/CLI.hpp>

#include "core/world/job.h"

namespace strata::cli {

// --method, --features, --reduce, --neighbours, and --set for every other parameter of the job
// "train". Written to `parameters` while the command line is parsed, each as that job takes it.
void AddTrainingOptions(CLI::App* verb, JobParameters& parameters);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_OPTIONS_H_
