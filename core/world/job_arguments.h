// What one job was told, read by the table of its kind.
#ifndef STRATA_CORE_WORLD_JOB_ARGUMENTS_H_
#define STRATA_CORE_WORLD_JOB_ARGUMENTS_H_

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include <Eigen/Geometry>

#include "core/world/job.h"

namespace strata {

// Values of a kind's parameters, each within its bounds: as given, or else the default.
class JobArguments {
 public:
  // See ReadJobArguments().
  explicit JobArguments(std::map<std::string, std::string> texts) : texts_(std::move(texts)) {}

  // Whether there is a value: a parameter without a default need not have one.
  bool Has(absl::string_view name) const { return texts_.contains(std::string(name)); }
  // REQUIRES of each: Has(name), and that type.
  bool Flag(absl::string_view name) const;
  std::int64_t Whole(absl::string_view name) const;
  double Real(absl::string_view name) const;
  // Without heights from −1e7 to 1e7 m.
  Eigen::AlignedBox3d Box(absl::string_view name) const;
  // Of a choice or a name.
  const std::string& Text(absl::string_view name) const { return texts_.at(std::string(name)); }

 private:
  std::map<std::string, std::string> texts_;
};

// INVALID_ARGUMENT naming the parameter, its value and what it may be, or all that `kind` takes; or
// the kinds there are.
absl::StatusOr<JobArguments> ReadJobArguments(absl::string_view kind,
                                              const JobParameters& parameters);

}  // namespace strata

#endif  // STRATA_CORE_WORLD_JOB_ARGUMENTS_H_
