#include "core/engine/optimize_settings.h"

#include <functional>
#include <map>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata {
namespace {

absl::Status Wrong(absl::string_view name, absl::string_view value, absl::string_view bound) {
  return absl::InvalidArgumentError(
      absl::StrCat("job parameter ", name, " = '", value.substr(0, 100), "' is not ", bound));
}

// Reads one parameter's text; false if it is not what it may be.
using Read = std::function<bool(const std::string&)>;
struct Parameter {
  Read read;
  const char* bound;
};

Read Flag(bool& to) {
  return [&to](const std::string& text) {
    to = text == "1";
    return to || text == "0";
  };
}

Read Whole(int& to, int most) {
  return [&to, most](const std::string& text) {
    return absl::SimpleAtoi(text, &to) && to >= 1 && to <= most;
  };
}

Read Real(double& to, double least, double most) {
  return [&to, least, most](const std::string& text) {
    return absl::SimpleAtod(text, &to) && to >= least && to <= most;
  };
}

Read WeightingName(Weighting& to) {
  return [&to](const std::string& text) {
    to = text == "local_global" ? Weighting::kLocalGlobal : Weighting::kCovariance;
    return text == "local_global" || text == "covariance";
  };
}

std::map<std::string, Parameter> ParametersOf(OptimizeSettings& settings) {
  return {{"dry_run", {Flag(settings.dry_run), "0 or 1"}},
          {"closures", {Flag(settings.closures), "0 or 1"}},
          {"planes", {Flag(settings.planes), "0 or 1"}},
          {"robust", {Flag(settings.robust), "0 or 1"}},
          {"rounds", {Whole(settings.rounds, 20), "in [1, 20]"}},
          {"pool", {Whole(settings.pool, 50), "in [1, 50]"}},
          {"weighting", {WeightingName(settings.weighting), "covariance or local_global"}},
          {"local_weight", {Real(settings.local_weight, 1e-6, 1.0 - 1e-6), "in (0, 1)"}},
          {"tolerance_m", {Real(settings.tolerance.translation_m, 0.0, 1.0), "in [0, 1]"}},
          {"tolerance_rad", {Real(settings.tolerance.rotation_rad, 0.0, 1.0), "in [0, 1]"}},
          {"threads", {Whole(settings.threads, 64), "in [1, 64]"}},
          {"automatic", {Flag(settings.automatic), "0 or 1"}}};
}

}  // namespace

absl::StatusOr<OptimizeSettings> ParseOptimizeSettings(const JobParameters& parameters) {
  OptimizeSettings settings;
  const std::map<std::string, Parameter> known = ParametersOf(settings);
  for (const auto& [name, value] : parameters) {
    const auto parameter = known.find(name);
    if (parameter == known.end()) {
      std::string names;
      for (const auto& [each, unused] : known) absl::StrAppend(&names, " ", each);
      return absl::InvalidArgumentError(absl::StrCat(
          "job parameter '", name.substr(0, 100), "' is unknown; ", kOptimizeJob, " takes", names));
    }
    if (!parameter->second.read(value)) return Wrong(name, value, parameter->second.bound);
  }
  return settings;
}

}  // namespace strata
