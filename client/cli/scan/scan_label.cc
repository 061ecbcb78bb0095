#include "client/cli/scan/scan_label.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"

#include "client/cli/classifier/label_classes.h"
#include "client/cli/terminal/arguments.h"
#include "client/formats/scan_reader.h"
#include "core/common/status.h"
#include "core/world/map_class.h"

namespace strata::cli {
namespace {

struct LabelOptions {
  std::string map;
  ScanId id;
  std::string file;
  std::string classes;  // which labels of the file are which class; empty: ids of the map
  std::optional<Prism> prism;
  std::string class_name;
  bool update = false;
};

absl::StatusOr<std::vector<std::uint16_t>> LabelsOfFile(Context& context,
                                                        const LabelOptions& options) {
  STRATA_ASSIGN_OR_RETURN(PointCloud cloud, ReadScan(options.file));
  if (cloud.label.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(options.file, ": points have no label, class or classification"));
  }
  if (options.classes.empty()) return std::move(cloud.label);
  STRATA_ASSIGN_OR_RETURN(const LabelClasses given, ReadLabelClasses(options.classes));
  STRATA_ASSIGN_OR_RETURN(
      const LabelClasses labels,
      ForClassesOfMap(context.database.maps(), context.call, options.map, given));
  labels.Apply(cloud);
  return std::move(cloud.label);
}

// The class for the points of the scan that are in the prism, 0 for the others.
absl::StatusOr<std::vector<std::uint16_t>> LabelsOfPrism(Context& context,
                                                         const LabelOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> table,
                          context.database.maps().ListClasses(context.call, options.map));
  STRATA_ASSIGN_OR_RETURN(const std::uint16_t id, ClassIdOf(table, options.class_name));
  api::Scans& scans = context.database.scans();
  STRATA_ASSIGN_OR_RETURN(const ScanInfo info, scans.Get(context.call, options.map, options.id));
  std::vector<std::uint16_t> labels;
  STRATA_RETURN_IF_ERROR(
      scans.GetPoints(context.call, options.map, options.id, [&](const PointCloud& piece) {
        for (const Eigen::Vector3f& point : piece.points) {
          const bool inside =
              point.allFinite() && options.prism->Contains(info.T_map_scan * point.cast<double>());
          labels.push_back(inside ? id : std::uint16_t{0});
        }
        return absl::OkStatus();
      }));
  return labels;
}

absl::Status Label(Context& context, const LabelOptions& options) {
  const bool update = options.update || options.prism.has_value();
  STRATA_ASSIGN_OR_RETURN(
      const std::vector<std::uint16_t> labels,
      options.prism.has_value() ? LabelsOfPrism(context, options) : LabelsOfFile(context, options));
  STRATA_RETURN_IF_ERROR(context.database.scans().SetLabels(
      context.call,
      options.map,
      options.id,
      labels,
      update ? api::LabelMode::kUpdate : api::LabelMode::kReplace));
  const auto unlabelled = std::count(labels.begin(), labels.end(), std::uint16_t{0});
  context.output.Object({{"id", options.id.ToString()},
                         {"points", labels.size()},
                         {"labelled", labels.size() - static_cast<std::size_t>(unlabelled)}});
  return absl::OkStatus();
}

void AddPlaces(CLI::App* label, const std::shared_ptr<LabelOptions>& options) {
  AddNumbers(
      label,
      "--box",
      "X0,Y0,Z0,X1,Y1,Z1",
      6,
      6,
      [options](const std::vector<double>& n) {
        if (n[0] > n[3] || n[1] > n[4] || n[2] > n[5]) {
          throw CLI::ValidationError("--box", "expected X0 <= X1, Y0 <= Y1 and Z0 <= Z1");
        }
        options->prism =
            Prism{{{n[0], n[1]}, {n[3], n[1]}, {n[3], n[4]}, {n[0], n[4]}}, n[2], n[5]};
      },
      "The points in this box, in the map [m]")
      ->excludes("--from");
  AddNumbers(
      label,
      "--polygon",
      "X,Y,X,Y,X,Y…",
      6,
      2000,
      [options](const std::vector<double>& n) {
        if (n.size() % 2 != 0) throw CLI::ValidationError("--polygon", "expected pairs of numbers");
        Prism& prism = options->prism.emplace();
        for (std::size_t i = 0; i < n.size(); i += 2) prism.corners.emplace_back(n[i], n[i + 1]);
      },
      "The points above and below this polygon, in the map [m]")
      ->excludes("--from")
      ->excludes("--box");
  AddNumbers(
      label,
      "--z",
      "Z0,Z1",
      2,
      2,
      [options](const std::vector<double>& n) {
        if (n[0] > n[1]) throw CLI::ValidationError("--z", "expected Z0 <= Z1");
        if (!options->prism.has_value()) {
          throw CLI::ValidationError("--z", "goes with --polygon, after it");
        }
        options->prism->z_min = n[0];
        options->prism->z_max = n[1];
      },
      "Of those, only the ones between these heights [m]");
  label->add_option("--class", options->class_name, "What they are: a class of the map, or its id")
      ->excludes("--from");
}

}  // namespace

bool Prism::Contains(const Eigen::Vector3d& point) const {
  if (point.z() < z_min || point.z() > z_max) return false;
  // How often a ray to the right crosses the outline.
  bool inside = false;
  for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
    const Eigen::Vector2d& a = corners[i];
    const Eigen::Vector2d& b = corners[j];
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    const double x = a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    if (point.x() < x) inside = !inside;
  }
  return inside;
}

void AddScanLabel(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<LabelOptions>();
  CLI::App* label =
      commands.Verb(noun,
                    "label",
                    "Say what the points of a scan are: all of them from a file, or those in a "
                    "part of the map. Counts more than what was uploaded, or a classifier says",
                    "strata scan label campus segway/12 --box 0,0,0.2,4,1,3 --class facade",
                    [options](Context& context) { return Label(context, *options); });
  AddMapName(label, options->map);
  AddScanId(label, options->id);
  label
      ->add_option("--from",
                   options->file,
                   "The scan's points with a label: PLY, PCD or text columns, in their order")
      ->type_name("FILE");
  label
      ->add_option("--classes",
                   options->classes,
                   "Which labels of the file are which class of the map, to which new ones are "
                   "added; else labels are ids")
      ->type_name("'NAME=LABEL,…;…'|FILE")
      ->needs("--from");
  label->add_flag("--update", options->update, "Labels that are 0 leave what people said before")
      ->needs("--from");
  AddPlaces(label, options);
  label->parse_complete_callback([options] {
    if (options->file.empty() == !options->prism.has_value()) {
      throw CLI::ValidationError("label", "give --from, or --box or --polygon");
    }
    if (options->prism.has_value() == options->class_name.empty()) {
      throw CLI::ValidationError("label", "--box and --polygon take --class");
    }
  });
}

}  // namespace strata::cli
