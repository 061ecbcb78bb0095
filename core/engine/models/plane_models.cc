#include "core/engine/models/plane_models.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

#include "core/common/status.h"
#include "core/engine/models/square_points.h"
#include "core/planes/models/plane_model_codec.h"
#include "core/planes/models/plane_model_finder.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

PlaneModelOptions OptionsOf(const JobArguments& arguments) {
  PlaneModelOptions options;
  options.rho_m = arguments.Real("rho_m");
  options.sigma_rad = arguments.Real("sigma_rad");
  options.directions = arguments.Flag("directions");
  options.colour = arguments.Flag("colour");
  options.max_planes = static_cast<int>(arguments.Whole("max_planes"));
  options.min_area_m2 = arguments.Real("min_area_m2");
  options.epsilon_m = arguments.Real("epsilon_m");
  return options;
}

// Two rounds over the squares: their planes, then where those have surface.
absl::StatusOr<PlaneModel> FindModel(SquarePoints& points,
                                     const PlaneModelOptions& options,
                                     JobContext& context) {
  PlaneModelFinder finder(options);
  const std::vector<PlanSquare>& squares = points.squares();
  const auto count = static_cast<double>(squares.size());
  const Stop& stop = context.stop();
  for (std::size_t i = 0; i < squares.size(); ++i) {
    STRATA_RETURN_IF_ERROR(
        context.Progress(0.5 * static_cast<double>(i) / count, "finding planes"));
    STRATA_ASSIGN_OR_RETURN(const PosedPoints own, points.Load(i, stop));
    STRATA_RETURN_IF_ERROR(finder.FindPlanes(own, squares[i], stop));
  }
  STRATA_RETURN_IF_ERROR(finder.JoinPlanes(stop));
  for (std::size_t i = 0; i < squares.size(); ++i) {
    STRATA_RETURN_IF_ERROR(
        context.Progress(0.5 + 0.4 * static_cast<double>(i) / count, "looking along rays"));
    STRATA_ASSIGN_OR_RETURN(const PosedPoints own, points.Load(i, stop));
    STRATA_RETURN_IF_ERROR(finder.Look(own, squares[i], stop));
  }
  STRATA_RETURN_IF_ERROR(context.Progress(0.9, "drawing polygons"));
  return finder.Finish(stop);
}

PointChoice ChoiceOf(const JobArguments& arguments) {
  PointChoice choice;
  choice.colour = arguments.Flag("colour");
  if (arguments.Has("region")) choice.region = arguments.Box("region");
  return choice;
}

// Where none of them has, planes by colour would be none at all.
absl::Status CheckColours(const SquarePoints& points) {
  if (points.scans() > 0 || points.without_colour() == 0) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("none of ",
                   points.without_colour(),
                   " scans has colours; upload scans with colours, or leave out colour=1"));
}

// What a user should know of the points that the planes are from: that there were too many in a
// square, or too few anywhere.
std::string PointsMessage(const SquarePoints& points, const PlaneModelInfo& info) {
  if (points.thinned_squares() > 0) {
    return absl::StrCat("; of ",
                        points.thinned_squares(),
                        " squares of ",
                        kSquareM,
                        " m with more than ",
                        kMostSquarePoints,
                        " points only one of up to ",
                        points.most_thinned(),
                        " points was taken");
  }
  if (info.planes > 0 || points.loaded() == 0) return "";
  return absl::StrCat("; a surface has to have some ",
                      kLeastPointsM2,
                      " points a square metre, and min_area_m2 of it");
}

std::string MessageOf(const PlaneModelInfo& info, const SquarePoints& points, bool region) {
  std::string message = absl::StrCat(info.planes,
                                     " planes with ",
                                     info.directions.size(),
                                     " main directions from ",
                                     info.scans,
                                     " scans");
  if (region && points.loaded() == 0) absl::StrAppend(&message, "; no point lies in the region");
  if (points.without_colour() > 0) {
    absl::StrAppend(&message, "; left out ", points.without_colour(), " scans without colours");
  }
  return message + PointsMessage(points, info) + points.damaged().Message();
}

absl::Status Keep(MapCore& core,
                  const PlaneModelInfo& info,
                  const PlaneModel& model,
                  const Stop& stop) {
  return core.writer().Run(Durability::kFull, 0, stop, [&](StorageWriter& writer) -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer.DeletePlaneModel());
    STRATA_RETURN_IF_ERROR(writer.PutPlaneModelPart(info.job, 0, EncodePlaneModelInfo(info)));
    for (std::size_t m = 0; m < model.planes.size(); ++m) {
      STRATA_RETURN_IF_ERROR(
          writer.PutPlaneModelPart(info.job, m + 1, EncodeModelPlane(model.planes[m])));
    }
    return absl::OkStatus();
  });
}

absl::StatusOr<std::uint64_t> JobOfModel(const MapState& state) {
  STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state.Reader());
  return reader->JobOfPlaneModel();
}

absl::StatusOr<std::string> ReadPart(const MapState& state, std::uint64_t job, std::uint64_t part) {
  {
    STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state.Reader());
    STRATA_ASSIGN_OR_RETURN(std::optional<std::string> bytes,
                            reader->FindPlaneModelPart(job, part));
    if (bytes.has_value()) return *std::move(bytes);
  }
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t now, JobOfModel(state));
  if (now != job) return absl::AbortedError("another plane model took its place; try again");
  return absl::DataLossError("it is not there");
}

}  // namespace

absl::Status RunPlanesJob(MapCore& core,
                          const JobInfo& job,
                          const JobArguments& arguments,
                          JobContext& context) {
  const PlaneModelOptions options = OptionsOf(arguments);
  STRATA_RETURN_IF_ERROR(options.Validate());
  PlaneModelInfo info;
  info.job = job.id;
  info.epoch = core.snapshots().current().epoch;
  const PointChoice choice = ChoiceOf(arguments);
  SquarePoints points(core, choice);
  STRATA_RETURN_IF_ERROR(points.ListScans(info.epoch, context.stop()));
  STRATA_RETURN_IF_ERROR(CheckColours(points));
  STRATA_ASSIGN_OR_RETURN(const PlaneModel model, FindModel(points, options, context));
  info.made = absl::Now();
  info.scans = points.scans();
  info.points = points.points();
  info.planes = model.planes.size();
  info.directions = model.directions;
  STRATA_RETURN_IF_ERROR(Keep(core, info, model, context.stop()));
  context.SetMetric("planes", static_cast<double>(info.planes));
  context.SetMetric("directions", static_cast<double>(info.directions.size()));
  context.SetMetric("scans", static_cast<double>(info.scans));
  context.SetMetric("scans_without_points", static_cast<double>(points.without_points()));
  context.SetMetric("squares_thinned", static_cast<double>(points.thinned_squares()));
  points.damaged().SetMetrics(context);
  if (choice.colour) {
    context.SetMetric("scans_without_colours", static_cast<double>(points.without_colour()));
  }
  context.SetMessage(MessageOf(info, points, choice.region.has_value()));
  return absl::OkStatus();
}

absl::StatusOr<PlaneModelInfo> ReadPlaneModel(
    const MapState& state,
    const Stop& stop,
    absl::FunctionRef<absl::Status(const ModelPlane&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t job, JobOfModel(state));
  if (job == 0) return absl::NotFoundError("no plane model; job start MAP planes makes one");
  STRATA_ASSIGN_OR_RETURN(const std::string head, ReadPart(state, job, 0));
  STRATA_ASSIGN_OR_RETURN(const PlaneModelInfo info, DecodePlaneModelInfo(head));
  for (std::uint64_t part = 1; part <= info.planes; ++part) {
    STRATA_RETURN_IF_ERROR(stop.status());
    const auto damaged = [part](const absl::Status& why) {
      return Annotate(why, absl::StrCat("plane model, part ", part));
    };
    const absl::StatusOr<std::string> bytes = ReadPart(state, job, part);
    if (!bytes.ok()) return damaged(bytes.status());
    const absl::StatusOr<ModelPlane> plane = DecodeModelPlane(*bytes);
    if (!plane.ok()) return damaged(plane.status());
    STRATA_RETURN_IF_ERROR(sink(*plane));
  }
  return info;
}

}  // namespace strata
