// The kinds of jobs and the parameters of each: the one table behind what a server takes, what a
// job runs with (job_arguments.h) and what people read about both.
#ifndef STRATA_CORE_WORLD_JOB_KINDS_H_
#define STRATA_CORE_WORLD_JOB_KINDS_H_

#include <cstdint>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

inline constexpr absl::string_view kRebuildJob = "rebuild";
inline constexpr absl::string_view kVerifyJob = "verify";
inline constexpr absl::string_view kOptimizeJob = "optimize";
inline constexpr absl::string_view kRevertJob = "revert";
inline constexpr absl::string_view kTrainJob = "train";
inline constexpr absl::string_view kClassifyJob = "classify";
inline constexpr absl::string_view kEvaluateJob = "evaluate";
inline constexpr absl::string_view kFadeJob = "fade";
inline constexpr absl::string_view kPlanesJob = "planes";
inline constexpr absl::string_view kObjectsJob = "objects";
inline constexpr absl::string_view kCompleteJob = "complete";

// What the text of a parameter may be: 0 or 1;
struct FlagType {};
// a whole number in [least, most];
struct WholeType {
  std::int64_t least = 0;
  std::int64_t most = std::numeric_limits<std::int64_t>::max();
};
// a number in [least, most];
struct RealType {
  double least = 0.0;
  double most = 0.0;
};
// one of these, "depth=N" being any text of that form with a whole number from 1;
struct ChoiceType {
  std::vector<absl::string_view> choices;
};
// a name as ValidateName() takes it;
struct NameType {};
// a box "X0,Y0,X1,Y1" or "X0,Y0,X1,Y1,Z0,Z1" in the map [m], of finite numbers.
struct BoxType {};
using JobParameterType = std::variant<FlagType, WholeType, RealType, ChoiceType, NameType, BoxType>;

struct JobParameter {
  absl::string_view name;
  JobParameterType type;
  absl::string_view default_text;  // empty: none; then `help` says what holds
  absl::string_view help;
  bool required = false;
};

struct JobKind {
  absl::string_view name;
  absl::string_view summary;
  std::vector<JobParameter> parameters;
};

// In the order in which people read them.
const std::vector<JobKind>& JobKinds();
// INVALID_ARGUMENT naming those there are.
absl::StatusOr<const JobKind*> FindJobKind(absl::string_view name);
// REQUIRES: the kind has it.
const JobParameter& JobParameterOf(absl::string_view kind, absl::string_view name);

// "0|1", "1..20", "amn|iamn|bayes", "NAME".
std::string ToString(const JobParameterType& type);
// What a text that does not fit is not: "0 or 1", "in [1, 20]", "amn, iamn or bayes".
std::string BoundOf(const JobParameterType& type);

// "rebuild, verify, optimize, … or fade".
std::string JobKindNames();
// The parameters of a kind with bounds and defaults, a line or two each.
std::string JobParametersText(const JobKind& kind);
// All kinds with their parameters and defaults, in lines of at most 77 characters. The comment of
// StartJobRequest in proto/strata/v1/jobs.proto holds the same lines.
std::string JobKindsText();

}  // namespace strata

#endif  // STRATA_CORE_WORLD_JOB_KINDS_H_
