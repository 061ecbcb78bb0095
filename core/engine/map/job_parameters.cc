#include "core/engine/map/job_parameters.h"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace strata {

ReadParameter FlagParameter(bool& to) {
  return [&to](const std::string& text) {
    to = text == "1";
    return to || text == "0";
  };
}

ReadParameter WholeParameter(int& to, int least, int most) {
  return [&to, least, most](const std::string& text) {
    return absl::SimpleAtoi(text, &to) && to >= least && to <= most;
  };
}

ReadParameter RealParameter(double& to, double least, double most) {
  return [&to, least, most](const std::string& text) {
    return absl::SimpleAtod(text, &to) && to >= least && to <= most;
  };
}

absl::Status ReadJobParameters(absl::string_view kind,
                               const JobParameters& parameters,
                               const KnownParameters& known) {
  for (const auto& [name, value] : parameters) {
    const auto parameter = known.find(name);
    if (parameter == known.end()) {
      std::string names;
      for (const auto& [each, unused] : known) absl::StrAppend(&names, " ", each);
      return absl::InvalidArgumentError(absl::StrCat(
          "job parameter '", name.substr(0, 100), "' is unknown; ", kind, " takes", names));
    }
    if (parameter->second.read(value)) continue;
    return absl::InvalidArgumentError(absl::StrCat("job parameter ",
                                                   name,
                                                   " = '",
                                                   value.substr(0, 100),
                                                   "' is not ",
                                                   parameter->second.bound));
  }
  return absl::OkStatus();
}

}  // namespace strata
