#include "client/cli/classifier/classifier_maps.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

#include "client/cli/classifier/classifier_scores.h"
#include "client/cli/job/job_runner.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/confirm.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/names.h"
#include "client/formats/file_bytes.h"
#include "core/classification/classifier.h"
#include "core/classification/evaluation.h"
#include "core/common/status.h"
#include "core/world/job_kinds.h"

namespace strata::cli {
namespace {

struct ClassifierVerb {
  std::string map;
  std::string name;
  std::string file;
  bool yes = false;
};

// "1=ground,2=wall": names beside ids.
std::vector<ClassName> ParseClassesText(const std::string& text) {
  std::vector<ClassName> classes;
  for (const absl::string_view part : absl::StrSplit(text, ',', absl::SkipEmpty())) {
    const std::pair<std::string, std::string> sides = absl::StrSplit(part, absl::MaxSplits('=', 1));
    std::uint32_t id = 0;
    if (absl::SimpleAtoi(sides.first, &id)) {
      classes.push_back({static_cast<std::uint16_t>(id), sides.second});
    }
  }
  return classes;
}

// Out of the metrics of an "evaluate" job.
ConfusionMatrix ConfusionOf(const JobInfo& job, const std::vector<ClassName>& classes) {
  ConfusionMatrix confusion(classes.size());
  for (std::size_t truth = 0; truth < classes.size(); ++truth) {
    for (std::size_t given = 0; given < classes.size(); ++given) {
      const auto count =
          job.metrics.find(absl::StrCat("confusion.", classes[truth].id, ".", classes[given].id));
      if (count == job.metrics.end()) continue;
      confusion.Add(static_cast<ClassIndex>(truth),
                    static_cast<ClassIndex>(given),
                    static_cast<std::uint64_t>(count->second));
    }
  }
  return confusion;
}

absl::Status List(Context& context, const ClassifierVerb& verb) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<ClassifierInfo> all,
                          context.database.classifiers().List(context.call, verb.map));
  Json rows = Json::array();
  for (const ClassifierInfo& info : all) {
    Json row = ToJson(info);
    const auto score = info.scores.find("accuracy");
    row["accuracy"] = score == info.scores.end() ? Json() : Json(score->second);
    rows.push_back(std::move(row));
  }
  context.output.List(rows,
                      {{"id", "ID"},
                       {"name", "NAME"},
                       {"accuracy", "ACCURACY"},
                       {"bytes", "BYTES"},
                       {"created", "CREATED"},
                       {"description", "DESCRIPTION"}});
  return absl::OkStatus();
}

absl::Status Show(Context& context, const ClassifierVerb& verb) {
  STRATA_ASSIGN_OR_RETURN(const ClassifierInfo info,
                          context.database.classifiers().Get(context.call, verb.map, verb.name));
  context.output.Object(ToJson(info));
  return absl::OkStatus();
}

absl::Status Export(Context& context, const ClassifierVerb& verb) {
  std::string bytes;
  STRATA_RETURN_IF_ERROR(context.database.classifiers().Export(
      context.call, verb.map, verb.name, [&bytes](absl::string_view piece) {
        bytes.append(piece.data(), piece.size());
        return absl::OkStatus();
      }));
  STRATA_RETURN_IF_ERROR(WriteFileBytes(verb.file, bytes));
  context.output.Object({{"name", verb.name}, {"file", verb.file}, {"bytes", bytes.size()}});
  return absl::OkStatus();
}

absl::Status Import(Context& context, const ClassifierVerb& verb) {
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(verb.file));
  STRATA_ASSIGN_OR_RETURN(
      const ClassifierInfo info,
      context.database.classifiers().Import(context.call, verb.map, verb.name, bytes));
  context.output.Object(ToJson(info));
  return absl::OkStatus();
}

absl::Status Delete(Context& context, const ClassifierVerb& verb) {
  STRATA_RETURN_IF_ERROR(Confirm(
      verb.yes, absl::StrCat("delete classifier ", verb.name, " of ", verb.map, " for good?")));
  STRATA_RETURN_IF_ERROR(context.database.classifiers().Delete(context.call, verb.map, verb.name));
  context.output.Object({{"deleted", verb.name}});
  return absl::OkStatus();
}

}  // namespace

absl::Status TrainOnMap(Context& context, const MapTraining& training, JobParameters parameters) {
  if (!training.name.empty()) parameters["name"] = training.name;
  if (training.folds >= 0) parameters["folds"] = absl::StrCat(training.folds);
  if (training.region_m > 0.0) parameters["region_m"] = absl::StrCat(training.region_m);
  if (training.wait) return RunJob(context, training.map, kTrainJob, parameters);
  STRATA_ASSIGN_OR_RETURN(
      const JobInfo job,
      context.database.jobs().Start(context.call, training.map, kTrainJob, parameters));
  PrintJob(job, context.output);
  return absl::OkStatus();
}

absl::Status EvaluateOnMap(Context& context, const std::string& map, const std::string& model) {
  STRATA_ASSIGN_OR_RETURN(const ClassifierInfo info,
                          context.database.classifiers().Get(context.call, map, model));
  STRATA_ASSIGN_OR_RETURN(
      const JobInfo started,
      context.database.jobs().Start(context.call, map, kEvaluateJob, {{"model", model}}));
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, FollowJob(context, map, started.id));
  STRATA_RETURN_IF_ERROR(StatusOf(job));
  const auto text = info.parameters.find("classes");
  const std::vector<ClassName> classes =
      ParseClassesText(text == info.parameters.end() ? "" : text->second);
  std::vector<std::string> names;
  for (const ClassName& name : classes) names.push_back(name.name);
  const ConfusionMatrix confusion = ConfusionOf(job, classes);
  if (context.output.json()) {
    context.output.Object(ScoresJson(confusion, names));
  } else {
    PrintScores(confusion, names, context.output);
  }
  return absl::OkStatus();
}

void AddClassifierMapVerbs(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<ClassifierVerb>();
  const auto verb = MapVerbs(commands, noun, options);
  const auto with_name = [&](CLI::App* app) {
    TakesName(app->add_option("MODEL", options->name, "Name of the classifier")->required(),
              kClassifierNames);
    return app;
  };
  verb("list", "The classifiers of a map", "strata classifier list campus", List);
  with_name(verb("show",
                 "One classifier: how it was trained and how good it was",
                 "strata classifier show campus street",
                 Show));
  with_name(verb("export",
                 "Write a classifier as a file, to keep or to import elsewhere",
                 "strata classifier export campus street --out street.model",
                 Export))
      ->add_option("--out", options->file, "The file to write")
      ->type_name("FILE")
      ->required();
  CLI::App* import = verb("import",
                          "Keep a classifier that was exported, or trained on files. Its classes "
                          "become those of the map that have their names",
                          "strata classifier import campus street.model --name street",
                          Import);
  import->add_option("FILE", options->file, "The classifier's file")->type_name("FILE")->required();
  import->add_option("--name", options->name, "What it is called from now on")->required();
  AddYes(with_name(verb("delete",
                        "Forget a classifier; labels that it gave stay",
                        "strata classifier delete campus street",
                        Delete)),
         options->yes);
}

}  // namespace strata::cli
