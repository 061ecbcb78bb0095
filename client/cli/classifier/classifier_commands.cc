// strata classifier …
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/classifier/classifier_files.h"
#include "client/cli/classifier/classifier_maps.h"
#include "client/cli/classifier/classifier_options.h"
#include "client/cli/terminal/command.h"

namespace strata::cli {
namespace {

constexpr char kClassesHelp[] =
    "Which labels of the files are which class, or a file that says so in lines; other labels are "
    "not looked at";
constexpr char kClassesType[] = "'NAME=LABEL,…;…'|FILE";
constexpr char kDataHelp[] =
    "Labelled scans, or folders of them: PLY, PCD or text columns with a label";

// Whether the command line names files; then no server is asked.
void ChooseByData(Commands& commands,
                  CLI::App* verb,
                  std::function<bool()> on_files,
                  FileAction file_action,
                  Action map_action) {
  verb->callback([&commands, on_files, file_action, map_action] {
    if (on_files()) {
      commands.selected_on_files = file_action;
    } else {
      commands.selected = map_action;
    }
  });
}

void AddTrain(Commands& commands, CLI::App* noun) {
  auto training = std::make_shared<FileTraining>();
  auto on_map = std::make_shared<MapTraining>();
  CLI::App* verb = commands.Verb(
      noun,
      "train",
      "Learn to tell classes of points apart: from all labelled scans of a map, or, with --data, "
      "from labelled files alone. Without --classes every label but 0 is a class",
      "strata classifier train campus --method amn --name street --wait\n"
      "  strata classifier train --data a.ply b.ply --classes 'ground=1,2;wall=7' --out "
      "street.model",
      {});
  ChooseByData(
      commands,
      verb,
      [training] { return !training->data.empty(); },
      [training](FileContext& context) { return TrainOnFiles(context, *training); },
      [training, on_map](Context& context) {
        on_map->folds = training->folds > 0 ? training->folds : -1;
        on_map->region_m = training->region_m;
        return TrainOnMap(context, *on_map, training->parameters);
      });
  CLI::Option* map = verb->add_option("MAP", on_map->map, "Name of the map");
  CLI::Option* data =
      verb->add_option("--data", training->data, kDataHelp)->type_name("FILES")->excludes(map);
  verb->add_option("--classes", training->classes, kClassesHelp)
      ->type_name(kClassesType)
      ->needs(data);
  CLI::Option* out = verb->add_option("--out", training->out, "The classifier's file")
                         ->type_name("FILE")
                         ->needs(data);
  data->needs(out);
  verb->add_option("--name", on_map->name, "What the map calls the classifier")->needs(map);
  verb->add_flag("--wait", on_map->wait, "Return when the job is done; exit 1 unless it succeeded")
      ->needs(map);
  verb->parse_complete_callback([map, data] {
    if (map->empty() && data->empty()) throw CLI::RequiredError("MAP or --data");
  });
  AddTrainingOptions(verb, training->parameters);
  verb->add_option(
          "--folds",
          training->folds,
          "Score the method too: learn so often, each time without some of the files or scans, "
          "and label those")
      ->check(CLI::Range(2, 1000));
  verb->add_option("--region-size",
                   training->region_m,
                   "Of the score: leave out whole squares of so many metres instead of files or "
                   "scans; for one large file, or scans that see the same places")
      ->check(CLI::PositiveNumber);
}

void AddEvaluate(Commands& commands, CLI::App* noun) {
  auto evaluation = std::make_shared<FileEvaluation>();
  auto words = std::make_shared<std::vector<std::string>>();
  CLI::App* verb = commands.Verb(
      noun,
      "evaluate",
      "How well a classifier labels points whose labels are known: those that people labelled in a "
      "map, or, with --data, files. Without --classes labels are ids of the classifier's classes",
      "strata classifier evaluate campus street\n"
      "  strata classifier evaluate street.model --data c.ply --classes 'ground=1,2;wall=7' "
      "--picture confusion.png",
      {});
  ChooseByData(
      commands,
      verb,
      [evaluation] { return !evaluation->data.empty(); },
      [evaluation, words](FileContext& context) {
        evaluation->model = words->front();
        return EvaluateOnFiles(context, *evaluation);
      },
      [words](Context& context) { return EvaluateOnMap(context, words->front(), words->back()); });
  verb->add_option("MODEL", *words, "A map and its classifier; with --data the classifier's file")
      ->type_name("MAP MODEL|FILE")
      ->expected(1, 2)
      ->required();
  CLI::Option* data = verb->add_option("--data", evaluation->data, kDataHelp)->type_name("FILES");
  verb->add_option("--classes", evaluation->classes, kClassesHelp)
      ->type_name(kClassesType)
      ->needs(data);
  verb->add_option("--picture", evaluation->picture, "Draw the confusion matrix")
      ->type_name("FILE.png")
      ->needs(data);
  verb->parse_complete_callback([words, data] {
    if (words->size() != (data->empty() ? 2U : 1U)) {
      throw CLI::ValidationError("MODEL", "give MAP and MODEL, or a file and --data");
    }
  });
}

void AddApply(Commands& commands, CLI::App* noun) {
  auto labelling = std::make_shared<FileLabelling>();
  CLI::App* verb = commands.FileVerb(
      noun,
      "apply",
      "Label the points of a file with the classes of a classifier, by their ids",
      "strata classifier apply street.model --data scan.pcd --out labelled.ply",
      [labelling](FileContext& context) { return LabelFile(context, *labelling); });
  verb->add_option("MODEL", labelling->model, "The classifier's file")
      ->type_name("FILE")
      ->required();
  verb->add_option("--data", labelling->data, "The scan")->type_name("FILE")->required();
  verb->add_option("--out", labelling->out, "The finite points with a field label")
      ->type_name("FILE.ply|pcd")
      ->required();
}

}  // namespace

void AddClassifierCommands(Commands& commands) {
  CLI::App* noun =
      commands.Noun("classifier",
                    "Classifiers of points: learned from labelled scans, labelling others",
                    "strata classifier train --data a.ply b.ply --out street.model");
  AddTrain(commands, noun);
  AddEvaluate(commands, noun);
  AddApply(commands, noun);
  AddClassifierMapVerbs(commands, noun);
}

}  // namespace strata::cli
