#include "core/world/job_arguments.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include <Eigen/Geometry>

#include "core/common/status.h"
#include "core/world/job_kinds.h"
#include "core/world/names.h"

namespace strata {
namespace {

constexpr double kAnyHeightM = 1e7;

std::optional<Eigen::AlignedBox3d> ParseBox(absl::string_view text) {
  std::vector<double> n;
  for (const absl::string_view word : absl::StrSplit(text, ',')) {
    double value = 0.0;
    if (!absl::SimpleAtod(word, &value) || !std::isfinite(value)) return std::nullopt;
    n.push_back(value);
  }
  if (n.size() == 4) n.insert(n.end(), {-kAnyHeightM, kAnyHeightM});
  if (n.size() != 6 || n[0] >= n[2] || n[1] >= n[3] || n[4] >= n[5]) return std::nullopt;
  return Eigen::AlignedBox3d(Eigen::Vector3d(n[0], n[1], n[4]), Eigen::Vector3d(n[2], n[3], n[5]));
}

// Whether a text is what a type says.
struct TypeCheck {
  absl::string_view text;

  bool operator()(const FlagType&) const { return text == "0" || text == "1"; }
  bool operator()(const WholeType& whole) const {
    std::int64_t value = 0;
    return absl::SimpleAtoi(text, &value) && value >= whole.least && value <= whole.most;
  }
  bool operator()(const RealType& real) const {
    double value = 0.0;
    return absl::SimpleAtod(text, &value) && value >= real.least && value <= real.most;
  }
  bool operator()(const ChoiceType& type) const {
    return std::any_of(type.choices.begin(), type.choices.end(), [this](absl::string_view choice) {
      if (!absl::ConsumeSuffix(&choice, "=N")) return text == choice;
      absl::string_view number = text;
      return absl::ConsumePrefix(&number, choice) && absl::ConsumePrefix(&number, "=") &&
             TypeCheck{number}(WholeType{1});
    });
  }
  bool operator()(const NameType&) const { return ValidateName("", text).ok(); }
  bool operator()(const BoxType&) const { return ParseBox(text).has_value(); }
};

absl::Status Check(const JobKind& kind, const std::string& name, const std::string& text) {
  const auto parameter = std::find_if(
      kind.parameters.begin(), kind.parameters.end(), [&name](const JobParameter& each) {
        return each.name == name;
      });
  if (parameter == kind.parameters.end()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "job parameter '",
        name.substr(0, 100),
        "' is unknown; ",
        kind.name,
        " takes ",
        absl::StrJoin(kind.parameters, " ", [](std::string* out, const JobParameter& each) {
          absl::StrAppend(out, each.name);
        })));
  }
  if (std::visit(TypeCheck{text}, parameter->type)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "job parameter ", name, " = '", text.substr(0, 100), "' is not ", BoundOf(parameter->type)));
}

}  // namespace

bool JobArguments::Flag(absl::string_view name) const { return Text(name) == "1"; }

std::int64_t JobArguments::Whole(absl::string_view name) const {
  std::int64_t value = 0;
  return absl::SimpleAtoi(Text(name), &value) ? value : 0;
}

double JobArguments::Real(absl::string_view name) const {
  double value = 0.0;
  return absl::SimpleAtod(Text(name), &value) ? value : 0.0;
}

Eigen::AlignedBox3d JobArguments::Box(absl::string_view name) const {
  return ParseBox(Text(name)).value_or(Eigen::AlignedBox3d());
}

absl::StatusOr<JobArguments> ReadJobArguments(absl::string_view kind_name,
                                              const JobParameters& parameters) {
  STRATA_ASSIGN_OR_RETURN(const JobKind* const kind, FindJobKind(kind_name));
  for (const auto& [name, text] : parameters) {
    STRATA_RETURN_IF_ERROR(Check(*kind, name, text));
  }
  JobParameters texts = parameters;
  for (const JobParameter& parameter : kind->parameters) {
    const std::string name(parameter.name);
    if (!parameter.default_text.empty()) texts.emplace(name, parameter.default_text);
    if (!parameter.required || texts.contains(name)) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        kind_name, " takes the parameter ", name, ", as in ", name, "=", ToString(parameter.type)));
  }
  return JobArguments(std::move(texts));
}

}  // namespace strata
