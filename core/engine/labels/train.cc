#include "core/engine/labels/train.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "core/classification/training.h"
#include "core/classification/validation.h"
#include "core/common/status.h"
#include "core/engine/labels/classifier_store.h"
#include "core/engine/labels/labelled_scans.h"
#include "core/engine/scans/damaged_scans.h"

namespace strata {
namespace {

// Shares of the whole job.
constexpr double kReadingEnd = 0.1;
constexpr double kFeaturesEnd = 0.5;
constexpr double kValidationEnd = 0.9;

// Progress of a part of the job, as the job's own.
class Part {
 public:
  Part(JobContext& context, double begin, double end, absl::string_view phase)
      : context_(context), begin_(begin), end_(end), phase_(phase) {}
  absl::Status operator()(double share) const {
    return context_.Progress(begin_ + (end_ - begin_) * share, phase_);
  }

 private:
  JobContext& context_;
  const double begin_;
  const double end_;
  const absl::string_view phase_;
};

// A classifier that this job made before a restart.
absl::StatusOr<std::optional<ClassifierInfo>> MadeBy(MapCore& core, const JobInfo& job) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  STRATA_ASSIGN_OR_RETURN(const std::vector<ClassifierInfo> all, reader->ListClassifiers());
  for (const ClassifierInfo& info : all) {
    if (info.job == job.id) return std::optional<ClassifierInfo>(info);
  }
  return std::optional<ClassifierInfo>();
}

std::map<std::string, double> ScoresOf(const ConfusionMatrix& confusion,
                                       const std::vector<ClassName>& classes) {
  std::map<std::string, double> scores = {{"accuracy", confusion.Accuracy()},
                                          {"mean_iou", confusion.MeanIou()}};
  for (std::size_t k = 0; k < classes.size(); ++k) {
    if (const std::optional<double> iou = confusion.Iou(k); iou.has_value()) {
      scores[absl::StrCat("iou.", classes[k].name)] = *iou;
    }
  }
  return scores;
}

auto SourceOf(const LabelledScans& scans) {
  return [&scans](std::size_t k, absl::FunctionRef<absl::Status(const PointCloud&)> use) {
    return scans.Visit(k, use);
  };
}

absl::StatusOr<std::map<std::string, double>> Validate(const LabelledScans& scans,
                                                       const TrainingSet& set,
                                                       const TrainSettings& settings,
                                                       JobContext& context) {
  const std::vector<std::size_t> regions = scans.Regions(settings.region_m);
  const std::size_t folds =
      std::min<std::size_t>(*std::ranges::max_element(regions) + 1, settings.folds);
  if (folds < 2) return std::map<std::string, double>();
  const absl::StatusOr<ConfusionMatrix> confusion =
      CrossValidate(set,
                    regions,
                    SourceOf(scans),
                    folds,
                    Part(context, kFeaturesEnd, kValidationEnd, "validating"),
                    context.stop());
  // Without a fold there may be less than two classes; all scans together may do still.
  if (absl::IsInvalidArgument(confusion.status())) return std::map<std::string, double>();
  STRATA_RETURN_IF_ERROR(confusion.status());
  std::map<std::string, double> scores = ScoresOf(*confusion, scans.classes());
  scores["folds"] = static_cast<double>(folds);
  return scores;
}

void Report(const ClassifierInfo& info, JobContext& context) {
  context.SetMetric("model", static_cast<double>(info.id));
  context.SetMetric("bytes", static_cast<double>(info.bytes));
  for (const auto& [name, value] : info.scores) context.SetMetric(name, value);
  const auto accuracy = info.scores.find("accuracy");
  const std::string score =
      accuracy == info.scores.end()
          ? std::string(
                "not validated, which takes two labelled scans or regions, each with two classes")
          : absl::StrFormat("%.1f %% right of scans it had not seen", 100.0 * accuracy->second);
  context.SetMessage(absl::StrCat("classifier ", info.name, ": ", info.description, "; ", score));
}

}  // namespace

absl::StatusOr<TrainSettings> ParseTrainSettings(const JobArguments& arguments) {
  TrainSettings settings;
  TrainingOptions& options = settings.options;
  const absl::StatusOr<ReductionOptions> reduction = ParseReduction(arguments.Text("reduce"));
  if (!reduction.ok()) return Annotate(reduction.status(), "job parameter reduce");
  options.reduction = *reduction;
  if (arguments.Has("name")) settings.name = arguments.Text("name");
  STRATA_ASSIGN_OR_RETURN(options.method, ClassifierMethodFromName(arguments.Text("method")));
  STRATA_ASSIGN_OR_RETURN(options.features.set, FeatureSetFromName(arguments.Text("features")));
  options.neighbours = static_cast<int>(arguments.Whole("neighbours"));
  options.rounds = static_cast<int>(arguments.Whole("rounds"));
  options.slack_weight = arguments.Real("slack_weight");
  options.features.neighbours = static_cast<int>(arguments.Whole("feature_neighbours"));
  options.features.scales = static_cast<int>(arguments.Whole("scales"));
  options.features.voxel_m = arguments.Real("voxel_m");
  options.features.max_height_m = arguments.Real("max_height_m");
  options.features.plane_side_m = arguments.Real("plane_side_m");
  options.features.wall_distance_m = arguments.Real("wall_distance_m");
  options.features.spin_radius_m = arguments.Real("spin_radius_m");
  options.network.max_degree = static_cast<int>(arguments.Whole("network_degree"));
  options.network.draws = static_cast<int>(arguments.Whole("network_draws"));
  options.network.sigma_spacings = arguments.Real("network_sigma");
  settings.folds = static_cast<int>(arguments.Whole("folds"));
  settings.region_m = arguments.Real("region_m");
  return settings;
}

absl::Status RunTrainJob(MapCore& core,
                         const JobInfo& job,
                         const JobArguments& arguments,
                         JobContext& context) {
  STRATA_ASSIGN_OR_RETURN(const std::optional<ClassifierInfo> made, MadeBy(core, job));
  if (made.has_value()) {
    Report(*made, context);
    return absl::OkStatus();
  }
  STRATA_ASSIGN_OR_RETURN(const TrainSettings settings, ParseTrainSettings(arguments));
  DamagedScans damaged;
  STRATA_ASSIGN_OR_RETURN(const LabelledScans scans, LabelledScans::Read(core, damaged, context));
  if (scans.size() == 0) {
    return absl::FailedPreconditionError(
        "no scan has labels: upload some with labels, or give some with scan label");
  }
  ClassifierInfo info;
  STRATA_ASSIGN_OR_RETURN(const TrainingSet set,
                          ReadTrainingSet(scans.size(),
                                          SourceOf(scans),
                                          scans.classes(),
                                          settings.options,
                                          Part(context, kReadingEnd, kFeaturesEnd, "features"),
                                          context.stop()));
  STRATA_ASSIGN_OR_RETURN(info.scores, Validate(scans, set, settings, context));
  STRATA_RETURN_IF_ERROR(context.Progress(kValidationEnd, "learning"));
  STRATA_ASSIGN_OR_RETURN(const Classifier classifier, LearnClassifier(set, context.stop()));
  const std::string method(ToString(settings.options.method));
  info.name = settings.name.empty() ? absl::StrCat(method, "-", job.id) : settings.name;
  info.job = job.id;
  info.parameters = job.parameters;
  info.parameters["method"] = method;
  info.parameters["features"] = std::string(ToString(settings.options.features.set));
  info.description = absl::StrCat("learned from ",
                                  classifier.points_seen,
                                  " labelled points of ",
                                  scans.size(),
                                  scans.size() == 1 ? " scan" : " scans",
                                  ", ",
                                  classifier.points_kept,
                                  " after reduction");
  STRATA_ASSIGN_OR_RETURN(info, StoreClassifier(core, std::move(info), classifier));
  context.SetMetric("scans", static_cast<double>(scans.size()));
  context.SetMetric("points", static_cast<double>(scans.points()));
  damaged.SetMetrics(context);
  Report(info, context);
  return absl::OkStatus();
}

absl::Status RunEvaluateJob(MapCore& core, absl::string_view model, JobContext& context) {
  STRATA_ASSIGN_OR_RETURN(const StoredClassifier stored, LoadClassifier(core, model));
  DamagedScans damaged;
  STRATA_ASSIGN_OR_RETURN(const LabelledScans scans, LabelledScans::Read(core, damaged, context));
  const std::vector<ClassName>& classes = stored.classifier.classes;
  ConfusionMatrix confusion(classes.size());
  const Part part(context, kReadingEnd, 1.0, "classifying");
  for (std::size_t k = 0; k < scans.size(); ++k) {
    STRATA_RETURN_IF_ERROR(part(static_cast<double>(k) / static_cast<double>(scans.size())));
    STRATA_RETURN_IF_ERROR(scans.Visit(k, [&](const PointCloud& cloud) -> absl::Status {
      STRATA_ASSIGN_OR_RETURN(
          const ConfusionMatrix counts,
          EvaluateClassifier(stored.classifier, cloud, classes, context.stop()));
      confusion.Add(counts);
      return absl::OkStatus();
    }));
  }
  if (confusion.total() == 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("no point is labelled with a class of classifier ", stored.info.name));
  }
  context.SetMetric("scans", static_cast<double>(scans.size()));
  context.SetMetric("points", static_cast<double>(confusion.total()));
  for (const auto& [name, value] : ScoresOf(confusion, classes)) context.SetMetric(name, value);
  for (std::size_t truth = 0; truth < classes.size(); ++truth) {
    for (std::size_t given = 0; given < classes.size(); ++given) {
      if (confusion.count(truth, given) == 0) continue;
      context.SetMetric(absl::StrCat("confusion.", classes[truth].id, ".", classes[given].id),
                        static_cast<double>(confusion.count(truth, given)));
    }
  }
  damaged.SetMetrics(context);
  context.SetMessage(absl::StrFormat("classifier %s: accuracy %.4f, mean IoU %.4f",
                                     stored.info.name,
                                     confusion.Accuracy(),
                                     confusion.MeanIou()));
  return absl::OkStatus();
}

}  // namespace strata
