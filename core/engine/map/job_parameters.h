// Reads the parameters of jobs: texts that people give by name.
#ifndef STRATA_CORE_ENGINE_MAP_JOB_PARAMETERS_H_
#define STRATA_CORE_ENGINE_MAP_JOB_PARAMETERS_H_

#include <functional>
#include <map>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

#include "core/world/job.h"

namespace strata {

// Takes a parameter's text to where it belongs; false if it is not what it may be.
using ReadParameter = std::function<bool(const std::string&)>;

struct KnownParameter {
  ReadParameter read;
  std::string bound;  // what it may be, as in "0 or 1"
};
using KnownParameters = std::map<std::string, KnownParameter>;

// `to` must outlive what is returned. Bounds are closed.
ReadParameter FlagParameter(bool& to);  // 0 or 1
ReadParameter WholeParameter(int& to, int least, int most);
ReadParameter RealParameter(double& to, double least, double most);

// INVALID_ARGUMENT naming the parameter, its value and what it may be, or all that `kind` takes.
absl::Status ReadJobParameters(absl::string_view kind,
                               const JobParameters& parameters,
                               const KnownParameters& known);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_JOB_PARAMETERS_H_
