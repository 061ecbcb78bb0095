#include "client/cli/planes/storey_drawing.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include <Eigen/Geometry>

#include "client/formats/file_bytes.h"
#include "client/formats/planes/dxf_drawing.h"

namespace strata::cli {
namespace {

// Millimetres of paper.
constexpr double kMarginMm = 10.0;
constexpr double kHeadMm = 12.0;  // above the plan
constexpr double kFootMm = 24.0;  // below it
constexpr double kLongestMm = 390.0;
constexpr double kNarrowestMm = 150.0;  // for the texts
constexpr double kBarMm = 50.0;         // one of 1, 2, 5, 10, … m times 0.5 at any of the scales

constexpr char kStyle[] =
    "<style>"
    "text{font-family:sans-serif;font-size:3.2px;fill:#28282c}"
    ".title{font-size:5px}"
    ".floor{fill:#f1ead6;fill-rule:evenodd;stroke:#cfc6aa;stroke-width:.15}"
    ".obstacle{fill:#b9b9b5}"
    ".wall{fill:none;stroke:#1e1e24;stroke-width:.6;stroke-linecap:round}"
    ".unseen{fill:none;stroke:#8c8c94;stroke-width:.35;stroke-dasharray:1.6 1.2}"
    ".bar{fill:#1e1e24;stroke:#1e1e24;stroke-width:.2}"
    "</style>\n";

// 1, 2 or 5 times a power of ten.
double ScaleFor(double longest_m) {
  for (double decade = 10.0;; decade *= 10.0) {
    for (const double step : {1.0, 2.0, 5.0}) {
      if (longest_m * 1000.0 / (step * decade) <= kLongestMm) return step * decade;
    }
  }
}

// Where the map lies on the paper.
struct Sheet {
  Eigen::AlignedBox2d extent;  // [m]
  double scale = 10.0;         // metres of the map a metre of paper
  Eigen::Vector2d size_mm = Eigen::Vector2d::Zero();

  explicit Sheet(const StoreyPlan& plan) : extent(ExtentOf(plan)) {
    if (extent.isEmpty()) extent.extend(Eigen::Vector2d::Zero());
    scale = ScaleFor(extent.sizes().maxCoeff());
    size_mm = extent.sizes() * 1000.0 / scale +
              Eigen::Vector2d(2.0 * kMarginMm, 2.0 * kMarginMm + kHeadMm + kFootMm);
    size_mm.x() = std::max(size_mm.x(), kNarrowestMm);
  }
  double bottom_mm() const { return size_mm.y() - kMarginMm - kFootMm; }
  Eigen::Vector2d Place(const Eigen::Vector2d& p_map) const {
    const Eigen::Vector2d d = (p_map - extent.min()) * 1000.0 / scale;
    return {kMarginMm + d.x(), bottom_mm() - d.y()};
  }
};

std::string Escaped(absl::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (static_cast<unsigned char>(c) >= 0x20) {
      out += c;
    }
  }
  return out;
}

void AddTo(std::string& path, char command, const Eigen::Vector2d& p_mm) {
  absl::StrAppendFormat(&path, "%c%.3f %.3f", command, p_mm.x(), p_mm.y());
}

std::string SegmentsPath(const std::vector<PlanSegment>& segments, const Sheet& sheet) {
  std::string path;
  for (const auto& [a, b] : segments) {
    AddTo(path, 'M', sheet.Place(a));
    AddTo(path, 'L', sheet.Place(b));
  }
  return path;
}

std::string FloorsPath(const StoreyPlan& plan, const Sheet& sheet) {
  std::string path;
  for (const auto& ring : plan.floors) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      AddTo(path, i == 0 ? 'M' : 'L', sheet.Place(ring[i]));
    }
    path += 'Z';
  }
  return path;
}

std::string ObstaclesPath(const StoreyPlan& plan, const Sheet& sheet) {
  std::string path;
  for (const Eigen::AlignedBox2d& box : plan.obstacles) {
    const Eigen::Vector2d low = sheet.Place(box.min());
    const Eigen::Vector2d high = sheet.Place(box.max());
    AddTo(path, 'M', low);
    absl::StrAppendFormat(&path, "H%.3fV%.3fH%.3fZ", high.x(), high.y(), low.x());
  }
  return path;
}

void AddGroup(std::string& out, absl::string_view name, absl::string_view path) {
  if (path.empty()) return;
  absl::StrAppend(&out, "<g id=\"", name, "\"><path class=\"", name, "\" d=\"", path, "\"/></g>\n");
}

void AddText(std::string& out, double x_mm, double y_mm, absl::string_view text) {
  absl::StrAppendFormat(&out, "<text x=\"%.2f\" y=\"%.2f\">%s</text>\n", x_mm, y_mm, text);
}

// Half of it filled.
void AddScaleBar(std::string& out, const Sheet& sheet) {
  const double top = sheet.bottom_mm() + 8.0;
  absl::StrAppendFormat(
      &out,
      "<path class=\"bar\" d=\"M%1$.2f %2$.2fh%3$.2fv1.5h-%3$.2fZ\"/>\n"
      "<path class=\"bar\" style=\"fill:#fff\" d=\"M%4$.2f %2$.2fh%3$.2fv1.5h-%3$.2fZ\"/>\n",
      kMarginMm,
      top,
      kBarMm / 2.0,
      kMarginMm + kBarMm / 2.0);
  AddText(out, kMarginMm, top - 1.0, "0");
  AddText(out,
          kMarginMm + kBarMm - 2.0,
          top - 1.0,
          absl::StrFormat("%g m", kBarMm / 1000.0 * sheet.scale));
  AddText(out, kMarginMm + kBarMm + 8.0, top + 1.5, absl::StrFormat("1:%g", sheet.scale));
}

// Of what the plan has.
void AddLegend(std::string& out, const StoreyPlan& plan, const Sheet& sheet) {
  double x = kMarginMm + kBarMm + 24.0;
  const double y = sheet.bottom_mm() + 8.0;
  const auto add = [&](bool has, absl::string_view name, absl::string_view text, bool line) {
    if (!has) return;
    absl::StrAppendFormat(&out,
                          "<path class=\"%s\" d=\"M%.2f %.2f%s\"/>\n",
                          name,
                          x,
                          line ? y + 0.8 : y - 0.7,
                          line ? "h6" : "h6v3h-6Z");
    AddText(out, x + 7.5, y + 1.8, text);
    x += 12.0 + 1.8 * static_cast<double>(text.size());
  };
  add(!plan.walls.empty(), "wall", "wall", true);
  add(!plan.unseen.empty(), "unseen", "not seen", true);
  add(!plan.floors.empty(), "floor", "floor", false);
  add(!plan.obstacles.empty(), "obstacle", "obstacle", false);
}

void AddTexts(std::string& out,
              const StoreyPlan& plan,
              const Sheet& sheet,
              absl::string_view title) {
  absl::StrAppendFormat(&out,
                        "<text class=\"title\" x=\"%.2f\" y=\"%.2f\">%s</text>\n",
                        kMarginMm,
                        kMarginMm + 5.0,
                        Escaped(title));
  const Eigen::Vector2d& low = sheet.extent.min();
  const Eigen::Vector2d& high = sheet.extent.max();
  AddText(out,
          kMarginMm,
          sheet.size_mm.y() - kMarginMm - 4.0,
          absl::StrFormat("floor at z = %.2f m, cut at %.2f m; x %.2f to %.2f m, y %.2f to %.2f m, "
                          "%.2f m by %.2f m",
                          plan.storey_z_m,
                          plan.cut_z_m,
                          low.x(),
                          high.x(),
                          low.y(),
                          high.y(),
                          high.x() - low.x(),
                          high.y() - low.y()));
}

}  // namespace

std::string StoreySvg(const StoreyPlan& plan, absl::string_view title) {
  const Sheet sheet(plan);
  std::string out = absl::StrFormat(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<svg xmlns=\"http://www.w3.org/2000/svg\" version=\"1.1\" width=\"%1$.2fmm\" "
      "height=\"%2$.2fmm\" viewBox=\"0 0 %1$.2f %2$.2f\">\n"
      "<title>%3$s</title>\n"
      "<desc>x = %4$.6f m + (right - %5$.3f) * %6$g m, y = %7$.6f m + (%8$.3f - down) * %6$g m in "
      "the map</desc>\n",
      sheet.size_mm.x(),
      sheet.size_mm.y(),
      Escaped(title),
      sheet.extent.min().x(),
      kMarginMm,
      sheet.scale / 1000.0,
      sheet.extent.min().y(),
      sheet.bottom_mm());
  out += kStyle;
  absl::StrAppendFormat(&out,
                        "<rect width=\"%.2f\" height=\"%.2f\" fill=\"#fff\"/>\n",
                        sheet.size_mm.x(),
                        sheet.size_mm.y());
  AddGroup(out, "floor", FloorsPath(plan, sheet));
  AddGroup(out, "obstacle", ObstaclesPath(plan, sheet));
  AddGroup(out, "unseen", SegmentsPath(plan.unseen, sheet));
  AddGroup(out, "wall", SegmentsPath(plan.walls, sheet));
  AddScaleBar(out, sheet);
  AddLegend(out, plan, sheet);
  AddTexts(out, plan, sheet, title);
  return out + "</svg>\n";
}

std::string StoreyDxf(const StoreyPlan& plan) {
  DxfDrawing drawing({{"WALL", 7}, {"UNSEEN", 8, true}, {"FLOOR", 2}, {"OBSTACLE", 9}});
  const auto lift = [](const Eigen::Vector2d& p) { return Eigen::Vector3d(p.x(), p.y(), 0.0); };
  for (const auto& [a, b] : plan.walls) drawing.AddLine("WALL", lift(a), lift(b));
  for (const auto& [a, b] : plan.unseen) drawing.AddLine("UNSEEN", lift(a), lift(b));
  for (const auto& flat : plan.floors) {
    std::vector<Eigen::Vector3d> ring;
    ring.reserve(flat.size());
    for (const Eigen::Vector2d& p : flat) ring.push_back(lift(p));
    drawing.AddRing("FLOOR", ring);
  }
  for (const Eigen::AlignedBox2d& box : plan.obstacles) drawing.AddSolid("OBSTACLE", box);
  return drawing.Text();
}

absl::Status WriteStorey(const std::filesystem::path& path,
                         const StoreyPlan& plan,
                         absl::string_view title) {
  const std::string ending = absl::AsciiStrToLower(path.extension().string());
  if (ending == ".svg") return WriteFileBytes(path, StoreySvg(plan, title));
  if (ending == ".dxf") return WriteFileBytes(path, StoreyDxf(plan));
  return absl::InvalidArgumentError(
      absl::StrCat("floor plans are written as .svg and .dxf, got ", path.string()));
}

}  // namespace strata::cli
