#include "client/cli/classifier_options.h"

#include <cstdint>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"

namespace strata::cli {
namespace {

// The value, or the end of the parsing.
template <typename T>
T ValueOf(const std::string& option, absl::StatusOr<T> value) {
  if (!value.ok()) throw CLI::ValidationError(option, std::string(value.status().message()));
  return *std::move(value);
}

}  // namespace

absl::StatusOr<ReductionOptions> ParseReduction(const std::string& text) {
  ReductionOptions options;
  const std::pair<absl::string_view, absl::string_view> parts =
      absl::StrSplit(text, absl::MaxSplits('=', 1));
  const auto [kind, number] = parts;
  if (text == "auto") {
    options.kind = ReductionKind::kPure;
  } else if (text == "none") {
    options.kind = ReductionKind::kNone;
  } else if (kind == "depth" && absl::SimpleAtoi(number, &options.depth)) {
    options.kind = ReductionKind::kDepth;
  } else if (kind == "random" && absl::SimpleAtoi(number, &options.count)) {
    options.kind = ReductionKind::kRandom;
  } else {
    return absl::InvalidArgumentError(absl::StrCat(
        "reduction '", text.substr(0, 40), "' is none of auto, none, depth=N, random=N"));
  }
  STRATA_RETURN_IF_ERROR(options.Validate());
  return options;
}

void AddTrainingOptions(CLI::App* verb, TrainingOptions& options) {
  verb->add_option_function<std::string>(
          "--method",
          [&options](const std::string& name) {
            options.method = ValueOf("--method", ClassifierMethodFromName(name));
          },
          "amn and iamn respect neighbourhoods (associative Markov networks, on features and on "
          "distances to instances); bayes, knn and adaboost look at each point for itself")
      ->type_name("amn|iamn|bayes|knn|adaboost")
      ->default_str(std::string(ToString(options.method)));
  verb->add_option_function<std::string>(
          "--features",
          [&options](const std::string& name) {
            options.features.set = ValueOf("--features", FeatureSetFromName(name));
          },
          "What is seen of a point: shape of its surroundings at several scales and height above "
          "ground; angles and sides of walls; spin images")
      ->type_name("shape|wall|spin")
      ->default_str(std::string(ToString(options.features.set)));
  verb->add_option_function<std::string>(
          "--reduce",
          [&options](const std::string& text) {
            options.reduction = ValueOf("--reduce", ParseReduction(text));
          },
          "Fewer points to learn from: one for each region of one class, for each leaf of a tree "
          "of N levels, N drawn ones, or all")
      ->type_name("auto|depth=N|random=N|none")
      ->default_str("auto");
  verb->add_option("--neighbours",
                   options.neighbours,
                   "Nearest instances of each class that knn and iamn look at")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
}

}  // namespace strata::cli
