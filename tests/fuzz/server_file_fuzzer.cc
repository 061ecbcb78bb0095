// What a server reads of its operator and of whoever knocks: grants, options, tokens.
#include <cstddef>
#include <cstdint>
#include <string>

#include <CLI/CLI.hpp>
#include <fuzzer/FuzzedDataProvider.h>

#include "core/common/host_port.h"
#include "server/access/right.h"
#include "server/access/token.h"
#include "server/access/token_file.h"
#include "server/options.h"
#include "server/token_commands.h"
#include "tests/fuzz/input_file.h"
#include "tests/fuzz/require.h"

namespace strata::fuzz {
namespace {

void TryGrants(const std::string& text) {
  const auto grants = server::DecodeGrants(text);
  RequireGoodRefusal(grants.status());
  if (!grants.ok()) return;
  const std::string written = server::EncodeGrants(*grants);
  const auto again = server::DecodeGrants(written);
  Require(again.ok() && server::EncodeGrants(*again) == written, "what is read can be written");
}

// As stratad does with --config.
void TryOptions(const std::string& text) {
  const InputFile file(text);
  CLI::App app;
  const auto said = server::AddServeOptions(app);
  try {
    app.parse("--config " + file.path());
  } catch (const CLI::Error&) {
    return;
  }
  RequireGoodRefusal(said().status());
}

void TryToken(const std::string& text) {
  const auto token = server::ParseToken(text);
  if (token.has_value()) Require(token->ToString() == text, "a token has one text");
  server::SecretMatches(text, server::SecretHash("secret"));
}

void Try(int kind, const std::string& text) {
  switch (kind) {
    case 0:
      return TryGrants(text);
    case 1:
      return TryOptions(text);
    case 2:
      return TryToken(text);
    case 3:
      return RequireGoodRefusal(server::ParseLifetime(text).status());
    case 4:
      server::ParseRight(text);
      return;
    default:
      return RequireGoodRefusal(ParseHostPort(text).status());
  }
}

}  // namespace
}  // namespace strata::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const int kind = input.ConsumeIntegralInRange(0, 5);
  strata::fuzz::Try(kind, input.ConsumeRemainingBytesAsString());
  return 0;
}
