// Classifiers of maps: the verbs of `classifier` that ask a database.
#ifndef STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_MAPS_H_
#define STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_MAPS_H_

#include <string>

#include "absl/status/status.h"

#include "client/cli/terminal/command.h"
#include "core/world/job.h"

namespace strata::cli {

struct MapTraining {
  std::string map;
  std::string name;       // of the classifier; empty: the server's choice
  int folds = -1;         // of the validation over scans; -1: the server's choice
  double region_m = 0.0;  // > 0: scans of one square of this edge are left out together
  bool wait = false;
};
// Starts the job; with `wait` an error unless it succeeds.
absl::Status TrainOnMap(Context& context, const MapTraining& training, JobParameters parameters);

// Runs the job "evaluate" and prints its scores as EvaluateOnFiles() does.
absl::Status EvaluateOnMap(Context& context, const std::string& map, const std::string& model);

// list, show, export, import, delete.
void AddClassifierMapVerbs(Commands& commands, CLI::App* noun);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_CLASSIFIER_CLASSIFIER_MAPS_H_
