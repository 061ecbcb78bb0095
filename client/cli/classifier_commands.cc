// strata classifier …
#include <memory>

#include "client/cli/classifier_files.h"
#include "client/cli/classifier_options.h"
#include "client/cli/command.h"

namespace strata::cli {
namespace {

constexpr char kClassesHelp[] =
    "Which labels of the files are which class, or a file that says so in lines; other labels are "
    "not looked at";
constexpr char kClassesType[] = "'NAME=LABEL,…;…'|FILE";
constexpr char kDataHelp[] = "Labelled scans: PLY, PCD or text columns with a label";

void AddTrain(Commands& commands, CLI::App* noun) {
  auto training = std::make_shared<FileTraining>();
  CLI::App* verb = commands.FileVerb(
      noun,
      "train",
      "Learn to tell classes of points apart from labelled files. Without --classes every label "
      "but 0 is a class",
      "strata classifier train --data a.ply b.ply --classes 'ground=1,2;wall=7' --out street.model",
      [training](FileContext& context) { return TrainOnFiles(context, *training); });
  verb->add_option("--data", training->data, kDataHelp)->type_name("FILES")->required();
  verb->add_option("--classes", training->classes, kClassesHelp)->type_name(kClassesType);
  verb->add_option("--out", training->out, "The classifier's file")->type_name("FILE")->required();
  AddTrainingOptions(verb, training->options);
  verb->add_option("--folds",
                   training->folds,
                   "Score the method too: learn so often, each time without some of the files, "
                   "and label those")
      ->check(CLI::Range(2, 1000));
}

void AddEvaluate(Commands& commands, CLI::App* noun) {
  auto evaluation = std::make_shared<FileEvaluation>();
  CLI::App* verb = commands.FileVerb(
      noun,
      "evaluate",
      "How well a classifier labels files whose labels are known. Without --classes labels are "
      "ids of the classifier's classes",
      "strata classifier evaluate street.model --data c.ply --classes 'ground=1,2;wall=7' "
      "--picture confusion.png",
      [evaluation](FileContext& context) { return EvaluateOnFiles(context, *evaluation); });
  verb->add_option("MODEL", evaluation->model, "The classifier's file")
      ->type_name("FILE")
      ->required();
  verb->add_option("--data", evaluation->data, kDataHelp)->type_name("FILES")->required();
  verb->add_option("--classes", evaluation->classes, kClassesHelp)->type_name(kClassesType);
  verb->add_option("--picture", evaluation->picture, "Draw the confusion matrix")
      ->type_name("FILE.png");
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
}

}  // namespace strata::cli
