#include "client/formats/graph_file.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include <Eigen/Geometry>

#include "client/formats/file_bytes.h"
#include "client/formats/parsing/text_cursor.h"
#include "core/common/status.h"
#include "core/geometry/euler.h"
#include "core/posegraph/information.h"
#include "core/posegraph/semidefinite.h"

namespace strata {
namespace {

constexpr double kQuaternionTolerance = 0.01;

enum class Kind : std::uint8_t { kVertex2, kEdge2, kVertex3, kEdge3, kFix, kIgnored };
// How the numbers of a line are to be read.
enum class Dialect : std::uint8_t { kG2o, kToro };

struct Tag {
  absl::string_view name;
  Kind kind;
  Dialect dialect;
  std::size_t numbers;  // behind the vertices
};

constexpr Tag kTags[] = {
    {"VERTEX_SE3:QUAT", Kind::kVertex3, Dialect::kG2o, 7},
    {"EDGE_SE3:QUAT", Kind::kEdge3, Dialect::kG2o, 28},
    {"VERTEX_SE2", Kind::kVertex2, Dialect::kG2o, 3},
    {"EDGE_SE2", Kind::kEdge2, Dialect::kG2o, 9},
    {"FIX", Kind::kFix, Dialect::kG2o, 0},
    {"VERTEX2", Kind::kVertex2, Dialect::kToro, 3},
    {"EDGE2", Kind::kEdge2, Dialect::kToro, 9},
    {"VERTEX3", Kind::kVertex3, Dialect::kToro, 6},
    {"EDGE3", Kind::kEdge3, Dialect::kToro, 27},
    {"EQUIV", Kind::kIgnored, Dialect::kToro, 0},
};
// EDGE3 without information.
constexpr std::size_t kBareToroEdge = 6;

// A vertex or an edge with the line it came from; `Value` is a pose or a term.
template <typename Value>
struct Line {
  std::size_t line = 0;
  std::uint64_t i = 0, j = 0;
  Value value;
};

template <typename Vertex, typename Term>
struct Lines {
  std::vector<Line<Vertex>> vertices;
  std::vector<Line<Term>> edges;
  bool empty() const { return vertices.empty() && edges.empty(); }
};

struct Clipped {
  std::size_t count = 0;
  std::size_t dropped = 0;
  double least_eigenvalue = 0.0;
};

struct Parsed {
  Clipped clipped;
  Lines<Pose, RelativePoseTerm> spatial;
  Lines<PlanarPose, PlanarRelativeTerm> planar;
  std::vector<Line<bool>> fixed;
};

// The upper triangle row by row, as g2o and TORO's EDGE3 have it.
template <int size>
Eigen::Matrix<double, size, size> UpperTriangle(const double* v) {
  Eigen::Matrix<double, size, size> M;
  for (int r = 0; r < size; ++r) {
    for (int c = r; c < size; ++c) M(r, c) = M(c, r) = *v++;
  }
  return M;
}

absl::StatusOr<Pose> G2oPose(const TextCursor& cursor, const double* v) {
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);  // w first
  if (!(std::abs(q.norm() - 1.0) <= kQuaternionTolerance)) {
    return cursor.Error(absl::StrCat("quaternion has length ", q.norm(), ", expected 1"));
  }
  return MakePose(q, Eigen::Vector3d(v[0], v[1], v[2]));
}

Pose ToroPose(const double* v) {
  const EulerAngles angles{.roll_rad = v[3], .pitch_rad = v[4], .yaw_rad = v[5]};
  return MakePose(QuaternionOf(angles), Eigen::Vector3d(v[0], v[1], v[2]));
}

absl::StatusOr<Pose> SpatialPose(const TextCursor& cursor, Dialect dialect, const double* v) {
  if (dialect == Dialect::kToro) return ToroPose(v);
  return G2oPose(cursor, v);
}

// From [x y z roll pitch yaw].
Matrix6d InformationFromToro(const Matrix6d& toro) {
  Matrix6d information;
  information << toro.bottomRightCorner<3, 3>(), toro.bottomLeftCorner<3, 3>(),
      toro.topRightCorner<3, 3>(), toro.topLeftCorner<3, 3>();
  return information;
}

template <int size>
absl::Status Settle(const TextCursor& cursor,
                    Eigen::Matrix<double, size, size>& information,
                    Clipped& clipped) {
  if (ValidateSemidefinite<size>(information, "information").ok()) return absl::OkStatus();
  if (information.allFinite()) {
    clipped.least_eigenvalue =
        std::min(clipped.least_eigenvalue, ClipToSemidefinite<size>(information));
    ++clipped.count;
  }
  const absl::Status status = ValidateSemidefinite<size>(information, "information");
  return status.ok() ? status : cursor.Error(status.message());
}

absl::StatusOr<RelativePoseTerm> SpatialTerm(const TextCursor& cursor,
                                             Dialect dialect,
                                             const std::vector<double>& v,
                                             Clipped& clipped) {
  RelativePoseTerm term;
  STRATA_ASSIGN_OR_RETURN(term.T_i_j, SpatialPose(cursor, dialect, v.data()));
  if (dialect == Dialect::kG2o) {
    term.information = InformationFromG2o(UpperTriangle<6>(v.data() + 7));
  } else if (v.size() > kBareToroEdge) {
    term.information = InformationFromToro(UpperTriangle<6>(v.data() + kBareToroEdge));
  }
  STRATA_RETURN_IF_ERROR(Settle<6>(cursor, term.information, clipped));
  return term;
}

absl::StatusOr<PlanarRelativeTerm> PlanarTerm(const TextCursor& cursor,
                                              Dialect dialect,
                                              const std::vector<double>& v,
                                              Clipped& clipped) {
  PlanarRelativeTerm term;
  term.T_i_j = PlanarPose(v[0], v[1], v[2]);
  if (dialect == Dialect::kG2o) {
    term.information = UpperTriangle<3>(v.data() + 3);
  } else {  // Ixx Ixy Iyy Itt Ixt Iyt
    term.information << v[3], v[4], v[7], v[4], v[5], v[8], v[7], v[8], v[6];
  }
  STRATA_RETURN_IF_ERROR(Settle<3>(cursor, term.information, clipped));
  return term;
}

absl::StatusOr<std::uint64_t> VertexNumber(const TextCursor& cursor, absl::string_view word) {
  const std::optional<std::size_t> number = ParseCount(word);
  if (!number.has_value()) {
    return cursor.Error(
        absl::StrCat("expected the number of a vertex, a whole number from 0, found '",
                     word.substr(0, 40),
                     "'"));
  }
  return *number;
}

absl::StatusOr<Tag> TagOf(const TextCursor& cursor, absl::string_view name) {
  for (const Tag& tag : kTags) {
    if (tag.name == name) return tag;
  }
  return cursor.Error(absl::StrCat("'",
                                   name.substr(0, 40),
                                   "' is none of VERTEX_SE3:QUAT, EDGE_SE3:QUAT, VERTEX_SE2, "
                                   "EDGE_SE2, FIX, VERTEX2, EDGE2, VERTEX3, EDGE3; remove the line "
                                   "if the graph does without it"));
}

// The numbers of a line behind `first` words, as many as `tag` has.
absl::StatusOr<std::vector<double>> NumbersOf(const TextCursor& cursor,
                                              const Tag& tag,
                                              const std::vector<absl::string_view>& words,
                                              std::size_t first) {
  const std::size_t found = words.size() - first;
  const bool bare =
      tag.kind == Kind::kEdge3 && tag.dialect == Dialect::kToro && found == kBareToroEdge;
  if (found != tag.numbers && !bare) {
    return cursor.Error(absl::StrCat(tag.name,
                                     " takes ",
                                     first - 1,
                                     first == 2 ? " vertex and " : " vertices and ",
                                     tag.numbers,
                                     " numbers, found ",
                                     found,
                                     " numbers"));
  }
  std::vector<double> numbers;
  numbers.reserve(found);
  for (std::size_t k = first; k < words.size(); ++k) {
    const std::optional<double> number = ParseNumber(words[k]);
    if (!number.has_value() || !std::isfinite(*number)) {
      return cursor.Error(
          absl::StrCat("expected a finite number, found '", words[k].substr(0, 40), "'"));
    }
    numbers.push_back(*number);
  }
  return numbers;
}

absl::Status ParseVertex(const TextCursor& cursor,
                         const Tag& tag,
                         const std::vector<absl::string_view>& words,
                         Parsed& parsed) {
  if (words.size() < 2) return cursor.Error(absl::StrCat(tag.name, " without a vertex"));
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t id, VertexNumber(cursor, words[1]));
  STRATA_ASSIGN_OR_RETURN(const std::vector<double> v, NumbersOf(cursor, tag, words, 2));
  if (tag.kind == Kind::kVertex2) {
    parsed.planar.vertices.push_back(
        {.line = cursor.line_number(), .i = id, .value = {v[0], v[1], v[2]}});
    return absl::OkStatus();
  }
  STRATA_ASSIGN_OR_RETURN(const Pose pose, SpatialPose(cursor, tag.dialect, v.data()));
  parsed.spatial.vertices.push_back({.line = cursor.line_number(), .i = id, .value = pose});
  return absl::OkStatus();
}

absl::Status ParseEdge(const TextCursor& cursor,
                       const Tag& tag,
                       const std::vector<absl::string_view>& words,
                       Parsed& parsed) {
  if (words.size() < 3) return cursor.Error(absl::StrCat(tag.name, " without two vertices"));
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t i, VertexNumber(cursor, words[1]));
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t j, VertexNumber(cursor, words[2]));
  if (i == j) return cursor.Error(absl::StrCat("an edge from vertex ", i, " to itself"));
  STRATA_ASSIGN_OR_RETURN(const std::vector<double> v, NumbersOf(cursor, tag, words, 3));
  // What says nothing holds nothing, and no constraint of a map may be so.
  const auto add = [&](const auto& term, auto& edges) {
    if (term.information.isZero(0.0)) {
      ++parsed.clipped.dropped;
    } else {
      edges.push_back({.line = cursor.line_number(), .i = i, .j = j, .value = term});
    }
  };
  if (tag.kind == Kind::kEdge2) {
    STRATA_ASSIGN_OR_RETURN(const auto term, PlanarTerm(cursor, tag.dialect, v, parsed.clipped));
    add(term, parsed.planar.edges);
    return absl::OkStatus();
  }
  STRATA_ASSIGN_OR_RETURN(const auto term, SpatialTerm(cursor, tag.dialect, v, parsed.clipped));
  add(term, parsed.spatial.edges);
  return absl::OkStatus();
}

absl::Status ParseLine(const TextCursor& cursor,
                       const std::vector<absl::string_view>& words,
                       Parsed& parsed) {
  STRATA_ASSIGN_OR_RETURN(const Tag tag, TagOf(cursor, words[0]));
  switch (tag.kind) {
    case Kind::kIgnored:
      break;
    case Kind::kFix:
      for (std::size_t k = 1; k < words.size(); ++k) {
        STRATA_ASSIGN_OR_RETURN(const std::uint64_t id, VertexNumber(cursor, words[k]));
        parsed.fixed.push_back({.line = cursor.line_number(), .i = id, .value = true});
      }
      break;
    case Kind::kVertex2:
    case Kind::kVertex3:
      STRATA_RETURN_IF_ERROR(ParseVertex(cursor, tag, words, parsed));
      break;
    case Kind::kEdge2:
    case Kind::kEdge3:
      STRATA_RETURN_IF_ERROR(ParseEdge(cursor, tag, words, parsed));
      break;
  }
  if (!parsed.spatial.empty() && !parsed.planar.empty()) {
    return cursor.Error("spatial and planar lines in one file; split it into two graphs");
  }
  return absl::OkStatus();
}

absl::Status ErrorAt(std::size_t line, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("line ", line, ": ", what));
}

// The nodes' numbers, ascending: of the vertices, or without any of the edges.
template <typename Vertex, typename Term>
absl::StatusOr<std::vector<std::uint64_t>> NumbersOfNodes(Lines<Vertex, Term>& lines) {
  auto& vertices = lines.vertices;
  std::stable_sort(
      vertices.begin(), vertices.end(), [](const auto& a, const auto& b) { return a.i < b.i; });
  std::vector<std::uint64_t> ids;
  for (const auto& vertex : vertices) {
    if (!ids.empty() && ids.back() == vertex.i) {
      return ErrorAt(vertex.line, absl::StrCat("vertex ", vertex.i, " comes twice"));
    }
    ids.push_back(vertex.i);
  }
  if (!ids.empty()) return ids;
  for (const auto& edge : lines.edges) {
    ids.push_back(edge.i);
    ids.push_back(edge.j);
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

absl::StatusOr<std::size_t> NodeOf(const std::vector<std::uint64_t>& ids,
                                   std::uint64_t id,
                                   std::size_t line) {
  const auto found = std::lower_bound(ids.begin(), ids.end(), id);
  if (found == ids.end() || *found != id) {
    return ErrorAt(line,
                   absl::StrCat("vertex ",
                                id,
                                " is not in the file; add its line, or remove all lines of "
                                "vertices to start from the edges"));
  }
  return static_cast<std::size_t>(found - ids.begin());
}

template <typename Problem, typename Vertex, typename Term>
absl::StatusOr<GraphFile> Assemble(Lines<Vertex, Term>& lines,
                                   const std::vector<Line<bool>>& fixed,
                                   std::vector<Vertex> Problem::*poses,
                                   const Vertex& origin) {
  GraphFile file;
  STRATA_ASSIGN_OR_RETURN(file.ids, NumbersOfNodes(lines));
  file.has_poses = !lines.vertices.empty();
  Problem problem;
  for (const auto& vertex : lines.vertices) (problem.*poses).push_back(vertex.value);
  if (!file.has_poses) (problem.*poses).assign(file.ids.size(), origin);
  for (auto& edge : lines.edges) {
    STRATA_ASSIGN_OR_RETURN(edge.value.i, NodeOf(file.ids, edge.i, edge.line));
    STRATA_ASSIGN_OR_RETURN(edge.value.j, NodeOf(file.ids, edge.j, edge.line));
    problem.relative.push_back(edge.value);
  }
  if (!fixed.empty()) problem.fixed.assign(file.ids.size(), false);
  for (const Line<bool>& fix : fixed) {
    STRATA_ASSIGN_OR_RETURN(const std::size_t node, NodeOf(file.ids, fix.i, fix.line));
    problem.fixed[node] = true;
  }
  file.graph = std::move(problem);
  return file;
}

void AppendNumbers(const double* values, std::size_t count, std::string& text) {
  for (std::size_t k = 0; k < count; ++k) absl::StrAppendFormat(&text, " %.17g", values[k]);
}

template <int size>
void AppendUpperTriangle(const Eigen::Matrix<double, size, size>& M, std::string& text) {
  for (int r = 0; r < size; ++r) {
    for (int c = r; c < size; ++c) absl::StrAppendFormat(&text, " %.17g", M(r, c));
  }
  text += '\n';
}

void AppendPose(const Pose& pose, std::string& text) {
  Eigen::Quaterniond q(pose.linear());
  q.normalize();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  AppendNumbers(pose.translation().data(), 3, text);
  AppendNumbers(q.coeffs().data(), 4, text);  // x y z w
}

void AppendFixed(const std::vector<std::uint64_t>& ids,
                 const std::vector<bool>& fixed,
                 std::string& text) {
  for (std::size_t n = 0; n < fixed.size(); ++n) {
    if (fixed[n]) absl::StrAppend(&text, "FIX ", ids[n], "\n");
  }
}

std::string TextOf(const std::vector<std::uint64_t>& ids, const PoseGraphProblem& problem) {
  std::string text;
  for (std::size_t n = 0; n < ids.size(); ++n) {
    absl::StrAppend(&text, "VERTEX_SE3:QUAT ", ids[n]);
    AppendPose(problem.T_map_scan[n], text);
    text += '\n';
  }
  AppendFixed(ids, problem.fixed, text);
  for (const RelativePoseTerm& term : problem.relative) {
    absl::StrAppend(&text, "EDGE_SE3:QUAT ", ids[term.i], " ", ids[term.j]);
    AppendPose(term.T_i_j, text);
    AppendUpperTriangle<6>(InformationToG2o(term.information), text);
  }
  return text;
}

std::string TextOf(const std::vector<std::uint64_t>& ids, const PlanarPoseGraph& graph) {
  std::string text;
  for (std::size_t n = 0; n < ids.size(); ++n) {
    absl::StrAppend(&text, "VERTEX_SE2 ", ids[n]);
    AppendNumbers(graph.poses[n].data(), 3, text);
    text += '\n';
  }
  AppendFixed(ids, graph.fixed, text);
  for (const PlanarRelativeTerm& term : graph.relative) {
    absl::StrAppend(&text, "EDGE_SE2 ", ids[term.i], " ", ids[term.j]);
    AppendNumbers(term.T_i_j.data(), 3, text);
    AppendUpperTriangle<3>(term.information, text);
  }
  return text;
}

}  // namespace

absl::StatusOr<GraphFile> ParseGraph(absl::string_view text) {
  TextCursor cursor(text);
  Parsed parsed;
  while (const std::optional<absl::string_view> line = cursor.NextLine()) {
    const std::vector<absl::string_view> words = SplitWords(*line);
    if (words.empty() || words[0][0] == '#') continue;
    STRATA_RETURN_IF_ERROR(ParseLine(cursor, words, parsed));
  }
  if (parsed.planar.empty() && parsed.spatial.empty()) {
    return cursor.Error("expected vertices or edges, found the end of the file");
  }
  absl::StatusOr<GraphFile> file =
      parsed.spatial.empty()
          ? Assemble(parsed.planar, parsed.fixed, &PlanarPoseGraph::poses, PlanarPose(0, 0, 0))
          : Assemble(parsed.spatial,
                     parsed.fixed,
                     &PoseGraphProblem::T_map_scan,
                     Pose(Pose::Identity()));
  if (file.ok()) {
    file->clipped = parsed.clipped.count;
    file->dropped = parsed.clipped.dropped;
    file->least_eigenvalue = parsed.clipped.least_eigenvalue;
  }
  return file;
}

std::string ClippedWarning(const GraphFile& file) {
  const std::size_t kept =
      std::visit([](const auto& graph) { return graph.relative.size(); }, file.graph);
  const std::string of = absl::StrCat(" of ", kept + file.dropped, " informations ");
  std::string text;
  if (file.clipped > 0) {
    text = absl::StrCat(file.clipped,
                        of,
                        "have a negative eigenvalue, the least ",
                        file.least_eigenvalue,
                        "; each is replaced by the nearest positive semidefinite matrix");
  }
  if (file.dropped > 0) {
    absl::StrAppend(&text,
                    text.empty() ? "" : "; ",
                    file.dropped,
                    of,
                    "have no positive eigenvalue: their edges are left out");
  }
  return text;
}

absl::StatusOr<GraphFile> ReadGraph(const std::filesystem::path& path) {
  STRATA_ASSIGN_OR_RETURN(const std::string text, ReadFileBytes(path));
  absl::StatusOr<GraphFile> file = ParseGraph(text);
  if (!file.ok()) return Annotate(file.status(), path.string());
  return file;
}

std::string G2oText(const GraphFile& file) {
  return std::visit([&file](const auto& graph) { return TextOf(file.ids, graph); }, file.graph);
}

}  // namespace strata
