#include "client/cli/classifier/classifier_options.h"

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

#include "core/world/job_arguments.h"
#include "core/world/job_kinds.h"

namespace strata::cli {
namespace {

// Parameters that have an option, also where it has another name or does not concern files.
constexpr std::array<std::pair<absl::string_view, absl::string_view>, 7> kOptions = {
    {{"name", "--name"},
     {"method", "--method"},
     {"features", "--features"},
     {"reduce", "--reduce"},
     {"neighbours", "--neighbours"},
     {"folds", "--folds"},
     {"region_m", "--region-size"}}};

// Keeps a parameter, or ends the parsing.
void Take(const std::string& option,
          const std::string& name,
          const std::string& text,
          JobParameters& parameters) {
  const absl::Status fits = ReadJobArguments(kTrainJob, {{name, text}}).status();
  if (!fits.ok()) throw CLI::ValidationError(option, std::string(fits.message()));
  parameters[name] = text;
}

void AddParameter(CLI::App* verb,
                  const std::string& name,
                  const std::string& help,
                  JobParameters& parameters) {
  const JobParameter& parameter = JobParameterOf(kTrainJob, name);
  const std::string option = absl::StrCat("--", name);
  verb->add_option_function<std::string>(
          option,
          [option, name, &parameters](const std::string& text) {
            Take(option, name, text, parameters);
          },
          help)
      ->type_name(ToString(parameter.type))
      ->default_str(std::string(parameter.default_text));
}

void Set(const std::string& text, JobParameters& parameters) {
  const std::pair<std::string, std::string> pair = absl::StrSplit(text, absl::MaxSplits('=', 1));
  for (const auto& [name, option] : kOptions) {
    if (pair.first == name) {
      throw CLI::ValidationError("--set", absl::StrCat("use ", option, " for ", name));
    }
  }
  Take("--set", pair.first, pair.second, parameters);
}

}  // namespace

void AddTrainingOptions(CLI::App* verb, JobParameters& parameters) {
  AddParameter(verb,
               "method",
               "amn and iamn respect neighbourhoods (associative Markov networks, on features and "
               "on distances to instances); bayes, knn and adaboost look at each point for itself",
               parameters);
  AddParameter(verb,
               "features",
               "What is seen of a point: shape of its surroundings at several scales and height "
               "above ground; angles and sides of walls; spin images",
               parameters);
  AddParameter(verb,
               "reduce",
               "Points to learn from: drawn so that rare classes count, one for each region of one "
               "class (thesis 9.3.2), one for each leaf of a tree of N levels, N drawn ones, or "
               "all",
               parameters);
  AddParameter(
      verb, "neighbours", "Nearest instances of each class that knn and iamn look at", parameters);
  verb->add_option_function<std::vector<std::string>>(
          "--set",
          [&parameters](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) Set(text, parameters);
          },
          "Any other parameter below, as in spin_radius_m=0.2; may be given several times")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  verb->footer(absl::StrCat(verb->get_footer(),
                            "\n\nParameters, of maps those of the job \"train\":\n",
                            JobParametersText(*FindJobKind(kTrainJob).value())));
}

}  // namespace strata::cli
