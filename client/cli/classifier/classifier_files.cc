#include "client/cli/classifier/classifier_files.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

#include "client/cli/classifier/classifier_scores.h"
#include "client/cli/classifier/label_classes.h"
#include "client/cli/picture/confusion_picture.h"
#include "client/cli/terminal/progress.h"
#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "client/formats/scan_list.h"
#include "client/formats/scan_reader.h"
#include "core/classification/classifier_codec.h"
#include "core/classification/regions.h"
#include "core/classification/validation.h"
#include "core/common/status.h"
#include "core/engine/labels/train.h"
#include "core/world/job_arguments.h"
#include "core/world/job_kinds.h"

namespace strata::cli {
namespace {

double SecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

absl::StatusOr<PointCloud> ReadLabelled(const ScanFile& scan) {
  STRATA_ASSIGN_OR_RETURN(PointCloud cloud, ReadScanFile(scan));
  if (cloud.label.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(scan.path.string(),
                     ": points have no label; expected a field label, class or "
                     "classification"));
  }
  return cloud;
}

// The files, and those in the folders, in the order of import.
absl::StatusOr<std::vector<ScanFile>> FilesOf(const std::vector<std::string>& data) {
  return ListScans({data.begin(), data.end()}, {.poses = kNoPoses});
}

absl::StatusOr<std::vector<PointCloud>> ReadAll(const std::vector<std::string>& data,
                                                const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<ScanFile> scans, FilesOf(data));
  std::vector<PointCloud> clouds;
  for (const ScanFile& scan : scans) {
    STRATA_RETURN_IF_ERROR(stop.status());
    STRATA_ASSIGN_OR_RETURN(PointCloud cloud, ReadLabelled(scan));
    clouds.push_back(std::move(cloud));
  }
  return clouds;
}

std::vector<std::string> NamesOf(const std::vector<ClassName>& classes) {
  std::vector<std::string> names;
  for (const ClassName& name : classes) names.push_back(name.name);
  return names;
}

// How many points each class has.
Json ClassesJson(const std::vector<ClassName>& classes, const std::vector<PointCloud>& clouds) {
  std::map<std::uint16_t, std::uint64_t> points;
  for (const PointCloud& cloud : clouds) {
    for (const std::uint16_t label : cloud.label) ++points[label];
  }
  Json rows = Json::array();
  for (const ClassName& name : classes) {
    rows.push_back({{"id", name.id}, {"name", name.name}, {"points", points[name.id]}});
  }
  return rows;
}

absl::StatusOr<Classifier> ReadClassifier(const std::string& path) {
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(path));
  absl::StatusOr<Classifier> classifier = DecodeClassifier(bytes);
  if (!classifier.ok()) return Annotate(classifier.status(), path);
  return classifier;
}

// Which labels of the files are which of the classifier's classes.
absl::StatusOr<LabelClasses> ClassesFor(const Classifier& classifier, const std::string& given) {
  if (!given.empty()) {
    STRATA_ASSIGN_OR_RETURN(const LabelClasses labels, ReadLabelClasses(given));
    return ForClassesOf(labels, classifier.classes);
  }
  LabelClasses labels{classifier.classes, {}};
  for (const ClassName& name : classifier.classes) labels.class_of_label[name.id] = name.id;
  return labels;
}

absl::Status WritePicture(const std::string& path,
                          const ConfusionMatrix& confusion,
                          const std::vector<std::string>& names) {
  std::vector<std::vector<std::uint64_t>> rows(names.size());
  for (std::size_t k = 0; k < names.size(); ++k) {
    for (std::size_t given = 0; given < names.size(); ++given) {
      rows[k].push_back(confusion.count(k, given));
    }
  }
  STRATA_ASSIGN_OR_RETURN(const std::string png,
                          picture::PngBytes(picture::DrawConfusion(rows, names)));
  return WriteFileBytes(path, png);
}

// Files are classified one after the other; no more than one is in memory.
absl::StatusOr<ConfusionMatrix> EvaluateAll(const Classifier& classifier,
                                            const LabelClasses& labels,
                                            const std::vector<std::string>& data,
                                            FileContext& context) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<ScanFile> scans, FilesOf(data));
  Progress progress(context.output.talk(), TalksToTerminal(), "evaluate");
  ConfusionMatrix confusion(labels.classes.size());
  std::uint64_t points = 0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    progress.Update(i, scans.size(), points);
    STRATA_ASSIGN_OR_RETURN(PointCloud cloud, ReadLabelled(scans[i]));
    labels.Apply(cloud);
    points += cloud.size();
    const auto counts = EvaluateClassifier(classifier, cloud, labels.classes, context.stop);
    if (!counts.ok()) return Annotate(counts.status(), scans[i].path.string());
    confusion.Add(*counts);
  }
  return confusion;
}

absl::StatusOr<ConfusionMatrix> Validated(const FileTraining& training,
                                          const TrainingOptions& options,
                                          const std::vector<ClassName>& classes,
                                          const std::vector<PointCloud>& clouds,
                                          FileContext& context) {
  Progress progress(context.output.talk(), TalksToTerminal(), "validate");
  RegionClouds cut;
  if (training.region_m > 0.0) cut = CutIntoRegions(clouds, training.region_m);
  std::vector<std::size_t> each(clouds.size());
  std::iota(each.begin(), each.end(), std::size_t{0});
  const std::vector<PointCloud>& parts = training.region_m > 0.0 ? cut.clouds : clouds;
  STRATA_ASSIGN_OR_RETURN(const TrainingSet set,
                          ReadTrainingSet(
                              parts.size(),
                              SourceOf(parts),
                              classes,
                              options,
                              [&](double share) {
                                progress.Update(0.5 * share, "features");
                                return absl::OkStatus();
                              },
                              context.stop));
  return CrossValidate(
      set,
      training.region_m > 0.0 ? cut.regions : each,
      SourceOf(parts),
      static_cast<std::size_t>(training.folds),
      [&](double share) {
        progress.Update(0.5 + 0.5 * share, "files or regions left out");
        return absl::OkStatus();
      },
      context.stop);
}

}  // namespace

absl::Status TrainOnFiles(FileContext& context, const FileTraining& training) {
  STRATA_ASSIGN_OR_RETURN(const JobArguments arguments,
                          ReadJobArguments(kTrainJob, training.parameters));
  STRATA_ASSIGN_OR_RETURN(const TrainSettings settings, ParseTrainSettings(arguments));
  STRATA_ASSIGN_OR_RETURN(std::vector<PointCloud> clouds, ReadAll(training.data, context.stop));
  LabelClasses labels = EveryLabel(clouds);
  if (!training.classes.empty()) {
    STRATA_ASSIGN_OR_RETURN(labels, ReadLabelClasses(training.classes));
  }
  for (PointCloud& cloud : clouds) labels.Apply(cloud);
  std::optional<ConfusionMatrix> confusion;
  if (training.folds > 0) {
    STRATA_ASSIGN_OR_RETURN(confusion,
                            Validated(training, settings.options, labels.classes, clouds, context));
  }
  const auto begin = std::chrono::steady_clock::now();
  absl::StatusOr<Classifier> classifier = absl::UnknownError("not trained");
  {
    Progress progress(context.output.talk(), TalksToTerminal(), "train");
    classifier = TrainClassifier(
        clouds,
        labels.classes,
        settings.options,
        [&](double share) {
          progress.Update(share, share < 0.5 ? "features" : "learning");
          return absl::OkStatus();
        },
        context.stop);
  }
  if (!classifier.ok()) return classifier.status();
  const double seconds = SecondsSince(begin);
  const std::string bytes = EncodeClassifier(*classifier);
  STRATA_RETURN_IF_ERROR(WriteFileBytes(training.out, bytes));
  Json json = {{"out", training.out},
               {"method", std::string(ToString(classifier->method))},
               {"features", std::string(ToString(classifier->features.set))},
               {"classes", ClassesJson(labels.classes, clouds)},
               {"points_seen", classifier->points_seen},
               {"points_kept", classifier->points_kept},
               {"seconds", seconds},
               {"bytes", bytes.size()}};
  const std::vector<std::string> names = NamesOf(labels.classes);
  if (confusion.has_value() && context.output.json()) {
    json["folds"] = training.folds;
    json["validation"] = ScoresJson(*confusion, names);
  }
  context.output.Object(json);
  if (confusion.has_value() && !context.output.json()) {
    context.output.Text(
        absl::StrCat("\nvalidation, ",
                     training.folds,
                     training.region_m > 0.0 ? " folds of regions:" : " folds of whole files:"));
    PrintScores(*confusion, names, context.output);
  }
  return absl::OkStatus();
}

absl::Status EvaluateOnFiles(FileContext& context, const FileEvaluation& evaluation) {
  STRATA_ASSIGN_OR_RETURN(const Classifier classifier, ReadClassifier(evaluation.model));
  STRATA_ASSIGN_OR_RETURN(const LabelClasses labels, ClassesFor(classifier, evaluation.classes));
  STRATA_ASSIGN_OR_RETURN(const ConfusionMatrix confusion,
                          EvaluateAll(classifier, labels, evaluation.data, context));
  if (confusion.total() == 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        evaluation.data.front(),
        evaluation.data.size() > 1 ? " and others" : "",
        ": no label is of a class of the classifier; --classes says which labels are which class"));
  }
  const std::vector<std::string> names = NamesOf(classifier.classes);
  if (!evaluation.picture.empty()) {
    STRATA_RETURN_IF_ERROR(WritePicture(evaluation.picture, confusion, names));
  }
  if (context.output.json()) {
    context.output.Object(ScoresJson(confusion, names));
  } else {
    PrintScores(confusion, names, context.output);
  }
  return absl::OkStatus();
}

absl::Status LabelFile(FileContext& context, const FileLabelling& labelling) {
  const std::string ending =
      absl::AsciiStrToLower(std::filesystem::path(labelling.out).extension().string());
  if (ending != ".ply" && ending != ".pcd") {
    return absl::InvalidArgumentError(
        absl::StrCat(labelling.out, ": labelled points are written as .ply or .pcd"));
  }
  STRATA_ASSIGN_OR_RETURN(const Classifier classifier, ReadClassifier(labelling.model));
  STRATA_ASSIGN_OR_RETURN(PointCloud cloud, ReadScan(labelling.data));
  const auto begin = std::chrono::steady_clock::now();
  const auto classified = Classify(classifier, cloud, context.stop);
  if (!classified.ok()) return Annotate(classified.status(), labelling.data);
  const double seconds = SecondsSince(begin);
  cloud.label.resize(cloud.size());
  std::transform(
      classified->labels.begin(), classified->labels.end(), cloud.label.begin(), [&](ClassIndex k) {
        return classifier.classes[k].id;
      });
  const Geometry geometry = GeometryOf(cloud);
  STRATA_ASSIGN_OR_RETURN(const std::string bytes,
                          ending == ".ply" ? PlyBytes(geometry) : PcdBytes(geometry));
  STRATA_RETURN_IF_ERROR(WriteFileBytes(labelling.out, bytes));
  context.output.Object({{"out", labelling.out},
                         {"points", geometry.vertices.size()},
                         {"classes", ClassesJson(classifier.classes, {std::move(cloud)})},
                         {"seconds", seconds},
                         {"bytes", bytes.size()}});
  return absl::OkStatus();
}

}  // namespace strata::cli
