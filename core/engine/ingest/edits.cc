#include "core/engine/ingest/edits.h"

#include <bit>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/codec/bytes.h"
#include "core/common/status.h"
#include "core/world/value_codec.h"

namespace strata {
namespace {

EditRequest RequestOf(EditKind kind, const ScanId& id, std::string value) {
  EditRequest edit;
  edit.kind = kind;
  edit.scan = id;
  edit.value = std::move(value);
  return edit;
}

absl::Status Unreadable(const EditRequest& edit) {
  return absl::DataLossError(absl::StrCat("edit ", edit.number, " cannot be read"));
}

absl::StatusOr<std::vector<std::uint16_t>> LabelsOf(const EditRequest& edit) {
  ByteReader reader(edit.value);
  std::vector<std::uint16_t> labels(edit.value.size() / 2);
  for (std::uint16_t& label : labels) label = reader.Fixed<std::uint16_t>();
  if (reader.remaining() > 0) return Unreadable(edit);
  return labels;
}

absl::StatusOr<RobotProfile> ProfileOf(const EditRequest& edit) {
  ByteReader reader(edit.value);
  const auto next = [&reader] { return std::bit_cast<double>(reader.Fixed<std::uint64_t>()); };
  RobotProfile profile;
  for (double* const number : {&profile.radius_m,
                               &profile.height_m,
                               &profile.max_step_m,
                               &profile.max_slope_rad,
                               &profile.max_gap_m,
                               &profile.max_roughness_m}) {
    *number = next();
  }
  if (!reader.ok() || reader.remaining() > 0) return Unreadable(edit);
  STRATA_RETURN_IF_ERROR(ValidateRobotProfile(profile));
  return profile;
}

absl::Status TellInferred(MapCore& core, Integrator::Decision also) {
  return core.Publish({}, {}, true, [&](StorageWriter& writer) {
    core.NoteInferred();
    return also(writer);
  });
}

}  // namespace

EditRequest SettingPose(const ScanId& id, const Pose& T_map_scan) {
  return RequestOf(EditKind::kSetPose, id, EncodePose(T_map_scan));
}

EditRequest DeletingScan(const ScanId& id) { return RequestOf(EditKind::kDeleteScan, id, ""); }

EditRequest SettingLabels(const ScanId& id, const std::vector<std::uint16_t>& labels, bool update) {
  std::string bytes;
  bytes.reserve(2 * labels.size());
  for (const std::uint16_t label : labels) PutFixed(bytes, label);
  return RequestOf(update ? EditKind::kUpdateLabels : EditKind::kSetLabels, id, std::move(bytes));
}

EditRequest SettingDefaultProfile(const RobotProfile& profile) {
  std::string bytes;
  for (const double number : {profile.radius_m,
                              profile.height_m,
                              profile.max_step_m,
                              profile.max_slope_rad,
                              profile.max_gap_m,
                              profile.max_roughness_m}) {
    PutFixed(bytes, std::bit_cast<std::uint64_t>(number));
  }
  return RequestOf(EditKind::kSetDefaultProfile, {}, std::move(bytes));
}

EditRequest DeletingMap() { return RequestOf(EditKind::kDeleteMap, {}, ""); }

absl::Status CarryOut(const EditRequest& edit,
                      Integrator& integrator,
                      const Stop& stop,
                      Integrator::Decision also) {
  switch (edit.kind) {
    case EditKind::kSetPose: {
      STRATA_ASSIGN_OR_RETURN(const Pose T_map_scan, DecodePose(edit.value));
      return integrator.SetPose(edit.scan, T_map_scan, also);
    }
    case EditKind::kDeleteScan:
      return integrator.DeleteScan(edit.scan, also);
    case EditKind::kSetLabels:
    case EditKind::kUpdateLabels: {
      STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> labels, LabelsOf(edit));
      return integrator.SetPersonLabels(
          edit.scan, labels, edit.kind == EditKind::kUpdateLabels, also);
    }
    case EditKind::kSetDefaultProfile: {
      STRATA_ASSIGN_OR_RETURN(const RobotProfile profile, ProfileOf(edit));
      return integrator.SetDefaultProfile(profile, stop, also);
    }
    case EditKind::kTellInferred:
      return TellInferred(integrator.core(), also);
    case EditKind::kDeleteMap:
      break;
  }
  return Unreadable(edit);
}

}  // namespace strata
