#include "client/cli/classifier/label_classes.h"

#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"

#include "client/formats/file_bytes.h"
#include "core/common/status.h"
#include "core/world/map_class.h"

namespace strata::cli {
namespace {

constexpr std::size_t kMostClasses = 1000;  // as Validate(LabelledFeatures)
constexpr int kMostLabel = 65535;

absl::Status Bad(absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(
      "classes: ", what, "; expected 'name=label,label;name=label', labels 1 to 65535"));
}

absl::Status AddLabels(absl::string_view text, const ClassName& name, LabelClasses& result) {
  for (const absl::string_view word : absl::StrSplit(text, ',')) {
    int label = 0;
    if (!absl::SimpleAtoi(word, &label) || label < 1 || label > kMostLabel) {
      return Bad(absl::StrCat("'", word.substr(0, 40), "' of ", name.name, " is no label"));
    }
    if (!result.class_of_label.emplace(label, name.id).second) {
      return Bad(absl::StrCat("label ", label, " of ", name.name, " is there twice"));
    }
  }
  return absl::OkStatus();
}

absl::Status AddClass(absl::string_view text, LabelClasses& result) {
  const std::pair<absl::string_view, absl::string_view> parts =
      absl::StrSplit(text, absl::MaxSplits('=', 1));
  const ClassName name{static_cast<std::uint16_t>(result.classes.size() + 1),
                       std::string(absl::StripAsciiWhitespace(parts.first))};
  if (name.name.empty() || !absl::StrContains(text, '=')) {
    return Bad(absl::StrCat("'", text.substr(0, 40), "' is no class"));
  }
  for (const ClassName& other : result.classes) {
    if (other.name == name.name) return Bad(absl::StrCat("class ", name.name, " is there twice"));
  }
  if (result.classes.size() == kMostClasses) {
    return Bad(absl::StrCat("more than ", kMostClasses, " classes"));
  }
  result.classes.push_back(name);
  return AddLabels(parts.second, name, result);
}

std::string Names(const std::vector<ClassName>& classes) {
  return absl::StrJoin(classes, ", ", [](std::string* out, const ClassName& name) {
    absl::StrAppend(out, name.name);
  });
}

}  // namespace

void LabelClasses::Apply(PointCloud& cloud) const {
  for (std::uint16_t& label : cloud.label) {
    const auto found = class_of_label.find(label);
    label = found == class_of_label.end() ? 0 : found->second;
  }
}

absl::StatusOr<LabelClasses> ParseLabelClasses(absl::string_view text) {
  LabelClasses result;
  for (const absl::string_view line : absl::StrSplit(text, '\n')) {
    const absl::string_view before = line.substr(0, line.find('#'));
    for (absl::string_view entry : absl::StrSplit(before, ';')) {
      entry = absl::StripAsciiWhitespace(entry);
      if (!entry.empty()) STRATA_RETURN_IF_ERROR(AddClass(entry, result));
    }
  }
  if (result.classes.empty()) return Bad("there are none");
  return result;
}

absl::StatusOr<LabelClasses> ReadLabelClasses(const std::string& text_or_file) {
  if (absl::StrContains(text_or_file, '=')) return ParseLabelClasses(text_or_file);
  STRATA_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(text_or_file));
  absl::StatusOr<LabelClasses> classes = ParseLabelClasses(text);
  if (!classes.ok()) return Annotate(classes.status(), text_or_file);
  return classes;
}

LabelClasses EveryLabel(const std::vector<PointCloud>& clouds) {
  std::set<std::uint16_t> labels;
  for (const PointCloud& cloud : clouds) labels.insert(cloud.label.begin(), cloud.label.end());
  labels.erase(0);
  LabelClasses result;
  for (const std::uint16_t label : labels) {
    result.classes.push_back({label, absl::StrCat(label)});
    result.class_of_label.emplace(label, label);
  }
  return result;
}

absl::StatusOr<LabelClasses> ForClassesOf(const LabelClasses& labels,
                                          const std::vector<ClassName>& classes) {
  LabelClasses result{classes, {}};
  std::map<std::uint16_t, std::uint16_t> id;
  for (const ClassName& name : labels.classes) {
    const auto same = std::find_if(
        classes.begin(), classes.end(), [&](const ClassName& c) { return c.name == name.name; });
    if (same == classes.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat("class ", name.name, " is none of the classifier's: ", Names(classes)));
    }
    id[name.id] = same->id;
  }
  for (const auto& [label, of] : labels.class_of_label) result.class_of_label[label] = id.at(of);
  return result;
}

absl::StatusOr<LabelClasses> ForClassesOfMap(api::Maps& maps,
                                             const api::Call& call,
                                             const std::string& map,
                                             const LabelClasses& labels) {
  STRATA_ASSIGN_OR_RETURN(std::vector<MapClass> table, maps.ListClasses(call, map));
  const std::size_t known = table.size();
  for (const ClassName& name : labels.classes) {
    STRATA_RETURN_IF_ERROR(IdInTable(table, name.name, name.id).status());
  }
  for (std::size_t i = known; i < table.size(); ++i) {
    STRATA_RETURN_IF_ERROR(maps.SetClass(call, map, table[i]));
  }
  std::vector<ClassName> names;
  for (const MapClass& map_class : table) names.push_back({map_class.id, map_class.name});
  return ForClassesOf(labels, names);
}

}  // namespace strata::cli
