#include "client/cli/classifier/classifier_options.h"

#include <utility>
#include <variant>

#include "absl/status/statusor.h"

#include "core/world/job_kinds.h"

namespace strata::cli {
namespace {

// The value, or the end of the parsing.
template <typename T>
T ValueOf(const std::string& option, absl::StatusOr<T> value) {
  if (!value.ok()) throw CLI::ValidationError(option, std::string(value.status().message()));
  return *std::move(value);
}

}  // namespace

void AddTrainingOptions(CLI::App* verb, TrainingOptions& options) {
  verb->add_option_function<std::string>(
          "--method",
          [&options](const std::string& name) {
            options.method = ValueOf("--method", ClassifierMethodFromName(name));
          },
          "amn and iamn respect neighbourhoods (associative Markov networks, on features and on "
          "distances to instances); bayes, knn and adaboost look at each point for itself")
      ->type_name(ToString(JobParameterOf(kTrainJob, "method").type))
      ->default_str(std::string(ToString(options.method)));
  verb->add_option_function<std::string>(
          "--features",
          [&options](const std::string& name) {
            options.features.set = ValueOf("--features", FeatureSetFromName(name));
          },
          "What is seen of a point: shape of its surroundings at several scales and height above "
          "ground; angles and sides of walls; spin images")
      ->type_name(ToString(JobParameterOf(kTrainJob, "features").type))
      ->default_str(std::string(ToString(options.features.set)));
  verb->add_option_function<std::string>(
          "--reduce",
          [&options](const std::string& text) {
            options.reduction = ValueOf("--reduce", ParseReduction(text));
          },
          "Points to learn from: drawn so that rare classes count, one for each region of one "
          "class (thesis 9.3.2), one for each leaf of a tree of N levels, N drawn ones, or all")
      ->type_name(ToString(JobParameterOf(kTrainJob, "reduce").type))
      ->default_str(ToString(options.reduction));
  const auto& neighbours = std::get<WholeType>(JobParameterOf(kTrainJob, "neighbours").type);
  verb->add_option("--neighbours",
                   options.neighbours,
                   "Nearest instances of each class that knn and iamn look at")
      ->check(CLI::Range(neighbours.least, neighbours.most))
      ->capture_default_str();
}

}  // namespace strata::cli
