#include "client/formats/survey/e57_file.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <ios>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include <boost/crc.hpp>

#include "client/formats/parsing/byte_cursor.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr absl::string_view kE57Start = "ASTM-E57";
constexpr std::size_t kE57HeaderBytes = 48;
constexpr std::uint64_t kPagesAtATime = 64;

// Castagnoli's polynomial, as RFC 3720 has it.
std::uint32_t Crc32c(absl::string_view bytes) {
  boost::crc_optimal<32, 0x1EDC6F41, 0xFFFFFFFF, 0xFFFFFFFF, true, true> crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

absl::Status CheckPage(absl::string_view page, std::uint64_t index) {
  const std::size_t payload = page.size() - sizeof(std::uint32_t);
  const std::uint32_t found = Crc32c(page.substr(0, payload));
  const auto said = ByteCursor(page.substr(payload), true).Get<std::uint32_t>();
  if (found == said) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrFormat("page %d (byte %d): the checksum is %08x and of its bytes %08x: the file is "
                      "damaged; copy it anew",
                      index,
                      index * page.size(),
                      said,
                      found));
}

}  // namespace

absl::StatusOr<E57File> E57File::Open(const std::filesystem::path& path) {
  E57File file(path);
  if (!file.file_.is_open()) return absl::UnavailableError("cannot be opened");
  STRATA_RETURN_IF_ERROR(file.ReadHeader());
  return file;
}

absl::Status E57File::ReadHeader() {
  std::string start(kE57HeaderBytes, '\0');
  file_.read(start.data(), static_cast<std::streamsize>(start.size()));
  if (!file_ || start.substr(0, kE57Start.size()) != kE57Start) {
    return absl::InvalidArgumentError(
        absl::StrCat("expected '", kE57Start, "' and a header of ", kE57HeaderBytes, " bytes"));
  }
  ByteCursor cursor(start);
  cursor.Take(kE57Start.size());
  const auto major = cursor.Get<std::uint32_t>();
  const auto minor = cursor.Get<std::uint32_t>();
  const auto bytes = cursor.Get<std::uint64_t>();
  const auto xml_at = cursor.Get<std::uint64_t>();
  xml_bytes_ = cursor.Get<std::uint64_t>();
  const auto page_bytes = cursor.Get<std::uint64_t>();
  file_.seekg(0, std::ios::end);
  const auto there = static_cast<std::uint64_t>(file_.tellg());
  if (major != 1) {
    return absl::InvalidArgumentError(absl::StrCat("version ", major, ".", minor, "; 1 is read"));
  }
  if (page_bytes != kPageBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("pages of ", page_bytes, " bytes; expected ", kPageBytes));
  }
  if (bytes > there || bytes % kPageBytes != 0) {
    return absl::InvalidArgumentError(absl::StrCat("the header says ",
                                                   bytes,
                                                   " bytes in pages of ",
                                                   kPageBytes,
                                                   ", there are ",
                                                   there,
                                                   ": the file is cut short"));
  }
  pages_ = bytes / kPageBytes;
  STRATA_ASSIGN_OR_RETURN(xml_at_, PlaceOf(xml_at));
  return absl::OkStatus();
}

absl::StatusOr<std::uint64_t> E57File::PlaceOf(std::uint64_t physical) const {
  if (physical / kPageBytes >= pages_ || physical % kPageBytes >= kPagePayload) {
    return absl::InvalidArgumentError(
        absl::StrCat("a part should begin at byte ", physical, ", where none can"));
  }
  return physical / kPageBytes * kPagePayload + physical % kPageBytes;
}

absl::Status E57File::Read(std::uint64_t at, std::uint64_t count, std::string& bytes) {
  bytes.clear();
  if (at > size() || count > size() - at) {
    return absl::InvalidArgumentError(absl::StrCat(
        "expected ", count, " bytes from byte ", at, " of ", size(), " on (without checksums)"));
  }
  const std::uint64_t end = at + count;
  std::string pages;
  while (at < end) {
    const std::uint64_t first = at / kPagePayload;
    const std::uint64_t last = (end - 1) / kPagePayload;
    const std::uint64_t number = std::min(last - first + 1, kPagesAtATime);
    pages.resize(static_cast<std::size_t>(number * kPageBytes));
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(first * kPageBytes));
    file_.read(pages.data(), static_cast<std::streamsize>(pages.size()));
    if (!file_) return absl::UnavailableError("cannot be read");
    for (std::uint64_t i = 0; i < number; ++i) {
      const absl::string_view page = absl::string_view(pages).substr(
          static_cast<std::size_t>(i * kPageBytes), static_cast<std::size_t>(kPageBytes));
      STRATA_RETURN_IF_ERROR(CheckPage(page, first + i));
      const std::uint64_t from = at % kPagePayload;
      const std::uint64_t taken = std::min(kPagePayload - from, end - at);
      bytes.append(page.data() + from, static_cast<std::size_t>(taken));
      at += taken;
    }
  }
  return absl::OkStatus();
}

}  // namespace strata
