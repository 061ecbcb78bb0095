#include "core/world/job_kinds.h"

#include <algorithm>
#include <cstddef>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"

#include "core/world/map_info.h"

namespace strata {
namespace {

constexpr int kSummaryColumn = 10;
constexpr int kHelpColumn = 24;
constexpr char kBoxShape[] = "X0,Y0,X1,Y1[,Z0,Z1]";

JobParameter Threads() {
  return {"threads", WholeType{1, 64}, "", "Threads at work (the server's own number)"};
}

JobParameter Model() {
  return {"model", NameType(), "", "Name of the classifier; see classifier list", true};
}

std::vector<JobParameter> OptimizeParameters() {
  return {
      {"dry_run", FlagType(), "0", "Only propose"},
      {"closures", FlagType(), "1", "Look for loops that nobody closed yet"},
      {"planes", FlagType(), "1", "Walls and floors hold the scans that see them"},
      {"directions", FlagType(), "1", "Parallel walls turn the scans that see them alike"},
      {"robust", FlagType(), "1", "Leave out closures that contradict the rest"},
      {"rounds", WholeType{1, 50}, "30", "Most rounds of matching and optimising"},
      {"pool", WholeType{1, 50}, "5", "Consecutive scans that move as one"},
      {"weighting",
       ChoiceType{{"covariance", "local_global"}},
       "covariance",
       "How matches and planes are weighed"},
      {"local_weight", RealType{1e-6, 1.0 - 1e-6}, "0.5", "With local_global: weight of matches"},
      {"tolerance_m", RealType{0.0, 1.0}, "0.005", "Scans stay that would move less [m]"},
      {"tolerance_rad", RealType{0.0, 1.0}, "0.0005", "and would turn less [rad]"},
      Threads(),
      {"automatic", FlagType(), "0", "The server says so: nobody asked for the job"},
  };
}

std::vector<JobParameter> TrainParameters() {
  return {
      {"name", NameType(), "", "Name of the classifier (METHOD-ID, by the job's id)"},
      {"method",
       ChoiceType{{"amn", "iamn", "bayes", "knn", "adaboost"}},
       "amn",
       "How it learns; see classifier train"},
      {"features", ChoiceType{{"shape", "wall", "spin"}}, "shape", "What it sees of a point"},
      {"reduce",
       ChoiceType{{"auto", "pure", "none", "depth=N", "random=N"}},
       "auto",
       "Points that it learns from"},
      {"neighbours", WholeType{1, 100}, "5", "Nearest instances that knn and iamn look at"},
      {"rounds", WholeType{1, 10'000}, "100", "Rounds of adaboost"},
      {"slack_weight", RealType{1e-12, 1e12}, "100", "What misfits cost amn and iamn"},
      {"feature_neighbours", WholeType{4, 64}, "16", "Points around that features look at"},
      {"scales", WholeType{1, 8}, "4", "shape: scales, each twice as coarse"},
      {"voxel_m", RealType{0.01, 10.0}, "0.15", "shape: voxels of the second scale [m]"},
      {"max_height_m", RealType{0.01, 1000.0}, "15", "Height that counts as 1 [m]"},
      {"plane_side_m", RealType{0.001, 1.0}, "0.05", "wall: nearer is in the plane [m]"},
      {"wall_distance_m", RealType{0.01, 10.0}, "0.5", "wall: farther is not of it [m]"},
      {"spin_radius_m", RealType{0.0, 100.0}, "0", "spin: radius [m]; 0: ten spacings"},
      {"network_degree", WholeType{1, 16}, "3", "amn, iamn: most edges of a point"},
      {"network_draws", WholeType{1, 1000}, "8", "Tries of a point to find a neighbour"},
      {"network_sigma", RealType{0.01, 100.0}, "2", "Width of the draws, in spacings"},
      {"folds", WholeType{0, 100}, "5", "Folds of the validation over scans; 0: none"},
      {"region_m", RealType{0.0, 1e6}, "0", "Leave out squares so wide [m]; 0: scans"},
  };
}

std::vector<JobParameter> FadeParameters() {
  return {
      {"scans", WholeType{1, kMaxFadeAfter}, "", "Scans that looked (the map's fade_after, or 3)"},
      {"rays", WholeType{1, 100'000}, "10", "Rays of theirs together"},
      {"clearance_m", RealType{0.05, 10.0}, "0.3", "How far beyond the place a ray must end"},
      {"undo", FlagType(), "0", "Everything comes back"},
      Threads(),
  };
}

std::vector<JobParameter> PlanesParameters() {
  return {
      {"rho_m", RealType{0.0, 1.0}, "0", "Spread about a plane [m]; 0: as the points say"},
      {"sigma_rad", RealType{0.001, 0.5}, "0.03", "Of normals about a main direction [rad]"},
      {"directions", FlagType(), "1", "Planes heed the main directions of all"},
      {"colour", FlagType(), "0", "One colour a plane; only scans that have colours"},
      {"region", BoxType(), "", "Only this part of the map [m]; default: all of it"},
      {"max_planes", WholeType{1, 10'000}, "500", "In a square of 60 m"},
      {"min_area_m2", RealType{0.01, 10'000.0}, "1", "Smaller planes are left out [m²]"},
      {"epsilon_m", RealType{0.05, 5.0}, "0.25", "Points so near are one surface [m]"},
  };
}

std::vector<JobParameter> ObjectsParameters() {
  return {
      {"class", NameType(), "", "Only this class, by name or number; default: all"},
      {"region", BoxType(), "", "Only this part of the map [m]; default: all of it"},
      {"distance_m", RealType{0.0, 4.0}, "0", "Nearer is one [m]; 0: three times the spacing"},
      {"voxel_m", RealType{0.01, 1.0}, "0.05", "Points in such a cube count as one [m]"},
      {"min_points", WholeType{1, 1'000'000'000}, "50", "Fewer are no entity"},
  };
}

std::vector<JobParameter> CompleteParameters() {
  return {
      {"kind", NameType(), "", "Only this kind, by name or id; default: all"},
      {"voxel_m", RealType{0.01, 1.0}, "0.05", "Spacing of what is inferred [m]"},
  };
}

std::vector<JobKind> MakeJobKinds() {
  return {
      {kRebuildJob, "All derived data again from the scans.", {Threads()}},
      {kVerifyJob, "Everything checked; a mismatch fails the job.", {Threads()}},
      {kOptimizeJob, "Poses made globally consistent, in a new epoch.", OptimizeParameters()},
      {kRevertJob,
       "Poses and constraints of an earlier epoch.",
       {{"epoch", WholeType{1}, "", "Number of the epoch; see map history", true}}},
      {kTrainJob, "A classifier from all labelled scans.", TrainParameters()},
      {kClassifyJob, "A classifier labels every scan that it has not labelled yet.", {Model()}},
      {kEvaluateJob, "A classifier against labels that people gave or uploaded.", {Model()}},
      {kFadeJob,
       "Points through whose place later scans looked leave the tiles.",
       FadeParameters()},
      {kPlanesJob, "The walls, floors and slopes of the map as polygons.", PlanesParameters()},
      {kObjectsJob, "The things that points with a class make up.", ObjectsParameters()},
      {kCompleteJob, "What nobody saw of things, by others of their kinds.", CompleteParameters()},
  };
}

// "a, b or c".
std::string OneOf(const std::vector<absl::string_view>& words) {
  return absl::StrCat(absl::StrJoin(words.begin(), words.end() - 1, ", "), " or ", words.back());
}

struct TypeWriter {
  std::string operator()(const FlagType&) const { return "0|1"; }
  std::string operator()(const WholeType& whole) const {
    if (whole.most == WholeType().most) return "N";
    return absl::StrCat(whole.least, "..", whole.most);
  }
  std::string operator()(const RealType& real) const {
    return absl::StrFormat("%.12g..%.12g", real.least, real.most);
  }
  std::string operator()(const ChoiceType& choice) const {
    return absl::StrJoin(choice.choices, "|");
  }
  std::string operator()(const NameType&) const { return "NAME"; }
  std::string operator()(const BoxType&) const { return kBoxShape; }
};

struct BoundWriter {
  std::string operator()(const FlagType&) const { return "0 or 1"; }
  std::string operator()(const WholeType& whole) const {
    if (whole.most == WholeType().most) return absl::StrCat("a whole number from ", whole.least);
    return absl::StrCat("in [", whole.least, ", ", whole.most, "]");
  }
  std::string operator()(const RealType& real) const {
    return absl::StrFormat("in [%.12g, %.12g]", real.least, real.most);
  }
  std::string operator()(const ChoiceType& choice) const { return OneOf(choice.choices); }
  std::string operator()(const NameType&) const { return "1 to 100 of A-Z a-z 0-9 _ . -"; }
  std::string operator()(const BoxType&) const {
    return absl::StrCat(kBoxShape, " with X0 < X1, Y0 < Y1 and Z0 < Z1");
  }
};

// `left`, and `right` from `column` on: beside it if there is room, or below.
void AppendColumns(std::string& text,
                   const std::string& left,
                   int column,
                   absl::string_view right) {
  const bool fits = static_cast<int>(left.size()) < column;
  if (!fits) absl::StrAppend(&text, left, "\n");
  absl::StrAppend(&text, absl::StrFormat("%-*s%s\n", column, fits ? left : "", right));
}

}  // namespace

const std::vector<JobKind>& JobKinds() {
  static const auto* const kinds = new std::vector<JobKind>(MakeJobKinds());
  return *kinds;
}

absl::StatusOr<const JobKind*> FindJobKind(absl::string_view name) {
  for (const JobKind& kind : JobKinds()) {
    if (kind.name == name) return &kind;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("job kind '", name.substr(0, 100), "': use ", JobKindNames()));
}

const JobParameter& JobParameterOf(absl::string_view kind, absl::string_view name) {
  const std::vector<JobParameter>& parameters = FindJobKind(kind).value()->parameters;
  return *std::find_if(parameters.begin(), parameters.end(), [name](const JobParameter& each) {
    return each.name == name;
  });
}

std::string ToString(const JobParameterType& type) { return std::visit(TypeWriter(), type); }

std::string BoundOf(const JobParameterType& type) { return std::visit(BoundWriter(), type); }

std::string JobKindNames() {
  std::vector<absl::string_view> names;
  for (const JobKind& kind : JobKinds()) names.push_back(kind.name);
  return OneOf(names);
}

std::string JobParametersText(const JobKind& kind) {
  std::string text;
  for (const JobParameter& parameter : kind.parameters) {
    std::string help(parameter.help);
    if (!parameter.default_text.empty()) {
      absl::StrAppend(&help, " (", parameter.default_text, ")");
    }
    AppendColumns(
        text, absl::StrCat("  ", parameter.name, "=", ToString(parameter.type)), kHelpColumn, help);
  }
  return text;
}

std::string JobKindsText() {
  std::string text;
  for (const JobKind& kind : JobKinds()) {
    AppendColumns(text, std::string(kind.name), kSummaryColumn, kind.summary);
    absl::StrAppend(&text, JobParametersText(kind));
  }
  return text;
}

}  // namespace strata
