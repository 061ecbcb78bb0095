#include "client/cli/classifier/classifier_scores.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace strata::cli {
namespace {

Json OrNull(std::optional<double> value) { return value.has_value() ? Json(*value) : Json(); }

}  // namespace

Json ScoresJson(const ConfusionMatrix& confusion, const std::vector<std::string>& names) {
  Json per_class = Json::array();
  Json rows = Json::array();
  for (std::size_t k = 0; k < confusion.classes(); ++k) {
    Json row = Json::array();
    std::uint64_t support = 0;
    for (std::size_t given = 0; given < confusion.classes(); ++given) {
      row.push_back(confusion.count(k, given));
      support += confusion.count(k, given);
    }
    per_class.push_back({{"name", names[k]},
                         {"precision", OrNull(confusion.Precision(k))},
                         {"recall", OrNull(confusion.Recall(k))},
                         {"iou", OrNull(confusion.Iou(k))},
                         {"support", support}});
    rows.push_back(std::move(row));
  }
  return {{"accuracy", confusion.Accuracy()},
          {"mean_iou", confusion.MeanIou()},
          {"per_class", std::move(per_class)},
          {"confusion", std::move(rows)},
          {"points", confusion.total()}};
}

void PrintScores(const ConfusionMatrix& confusion,
                 const std::vector<std::string>& names,
                 Output& output) {
  const Json scores = ScoresJson(confusion, names);
  output.Text(absl::StrFormat("accuracy %.4f, mean IoU %.4f over %d points\n",
                              confusion.Accuracy(),
                              confusion.MeanIou(),
                              confusion.total()));
  output.List(scores["per_class"],
              {{"name", "CLASS"},
               {"precision", "PRECISION"},
               {"recall", "RECALL"},
               {"iou", "IOU"},
               {"support", "POINTS"}});
  output.Text("\ntrue class below each other, class given beside each other:");
  std::vector<Column> columns = {{"name", "CLASS"}};
  for (std::size_t k = 0; k < names.size(); ++k) columns.push_back({absl::StrCat(k), names[k]});
  Json rows = Json::array();
  for (std::size_t k = 0; k < names.size(); ++k) {
    Json row = {{"name", names[k]}};
    for (std::size_t given = 0; given < names.size(); ++given) {
      row[absl::StrCat(given)] = confusion.count(k, given);
    }
    rows.push_back(std::move(row));
  }
  output.List(rows, columns);
}

}  // namespace strata::cli
