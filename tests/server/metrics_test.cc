#include "server/metrics/metrics.h"

#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/common/host_port.h"
#include "server/metrics/engine_metrics.h"
#include "tests/support/status_matchers.h"

namespace strata::server {
namespace {

using ::strata::testing::StatusIs;
using ::testing::_;

// A scrape as text, by HTTP/1.0.
std::string Scrape(const std::string& address) {
  const HostPort parsed = ParseHostPort(address).value();
  const int connection = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(parsed.port));
  inet_pton(AF_INET, parsed.host.c_str(), &to.sin_addr);
  EXPECT_EQ(connect(connection, reinterpret_cast<const sockaddr*>(&to), sizeof(to)), 0);
  const std::string request = "GET /metrics HTTP/1.0\r\n\r\n";
  EXPECT_EQ(send(connection, request.data(), request.size(), 0),
            static_cast<ssize_t>(request.size()));
  std::string answer;
  std::vector<char> buffer(4096);
  for (ssize_t n = 0; (n = recv(connection, buffer.data(), buffer.size(), 0)) > 0;) {
    answer.append(buffer.data(), static_cast<std::size_t>(n));
  }
  close(connection);
  return answer;
}

// Series by name with labels, as Prometheus reads them: every line a comment or a series.
std::map<std::string, double> Series(const std::string& answer) {
  std::map<std::string, double> series;
  const std::string body = answer.substr(answer.find("\r\n\r\n") + 4);
  static const std::regex line_form(
      R"(([a-zA-Z_:][a-zA-Z0-9_:]*(\{([a-z]+="[^"\n]*",?)*\})?) ([-+.0-9a-zA-Z]+)\s*)");
  for (const absl::string_view line : absl::StrSplit(body, '\n', absl::SkipWhitespace())) {
    if (line[0] == '#') continue;
    std::smatch match;
    const std::string text(line);
    EXPECT_TRUE(std::regex_match(text, match, line_form)) << text;
    double value = 0.0;
    EXPECT_TRUE(absl::SimpleAtod(match[4].str(), &value)) << text;
    series[match[1].str()] = value;
  }
  return series;
}

TEST(MetricsTest, AScrapeHasWhatWasCounted) {
  CallMetrics calls;
  for (int i = 0; i < 3; ++i) {
    calls.Ended("Maps.Get", absl::StatusCode::kOk, absl::Milliseconds(30), 10, 100, "");
  }
  calls.Ended(
      "Maps.Get", absl::StatusCode::kUnauthenticated, absl::Microseconds(3), 1, 0, "ACCESS");
  EngineNumbers numbers;
  numbers.maps_not_opened = 2;
  MapNumbers map;
  map.map = "campus";
  map.file_bytes = 4096;
  map.journal_bytes = 1024;
  map.verified = absl::FromUnixSeconds(1'700'000'000);
  map.scans = 7;
  map.scans_pending = 2;
  map.pending_age = absl::Milliseconds(2500);
  map.commits = 3;
  map.commit_parts = 12;
  map.commit_time = absl::Milliseconds(1500);
  map.jobs[{"rebuild", JobState::kRunning}] = 1;
  numbers.maps.push_back(map);
  const auto gauges = [&numbers](MetricFamilies& families) {
    AddProcess(families, absl::Now() - absl::Seconds(5));
    AddEngine(families, numbers);
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const auto endpoint,
                              MetricsEndpoint::Open("127.0.0.1:0", calls, gauges));
  const auto series = Series(Scrape(endpoint->address()));
  const auto value = [&series](const std::string& name) {
    const auto found = series.find(name);
    EXPECT_NE(found, series.end()) << name;
    return found == series.end() ? -1.0 : found->second;
  };
  EXPECT_EQ(value("strata_calls_total{code=\"OK\",method=\"Maps.Get\"}"), 3);
  EXPECT_EQ(value("strata_calls_total{code=\"UNAUTHENTICATED\",method=\"Maps.Get\"}"), 1);
  EXPECT_EQ(value("strata_calls_rejected_total{reason=\"ACCESS\"}"), 1);
  EXPECT_EQ(value("strata_received_bytes_total{method=\"Maps.Get\"}"), 31);
  EXPECT_EQ(value("strata_sent_bytes_total{method=\"Maps.Get\"}"), 300);
  EXPECT_EQ(value("strata_call_seconds_count{method=\"Maps.Get\"}"), 4);
  EXPECT_EQ(value("strata_call_seconds_bucket{method=\"Maps.Get\",le=\"0.025\"}"), 1);
  EXPECT_EQ(value("strata_call_seconds_bucket{method=\"Maps.Get\",le=\"0.05\"}"), 4);
  EXPECT_EQ(value("strata_maps_not_opened"), 2);
  EXPECT_EQ(value("strata_map_file_bytes{map=\"campus\"}"), 4096);
  EXPECT_EQ(value("strata_map_journal_bytes{map=\"campus\"}"), 1024);
  EXPECT_EQ(value("strata_map_verified_timestamp_seconds{map=\"campus\"}"), 1.7e9);
  EXPECT_EQ(value("strata_map_backed_up_timestamp_seconds{map=\"campus\"}"), 0);
  EXPECT_EQ(value("strata_commits_total{map=\"campus\"}"), 3);
  EXPECT_EQ(value("strata_commit_parts_total{map=\"campus\"}"), 12);
  EXPECT_EQ(value("strata_commit_seconds_total{map=\"campus\"}"), 1.5);
  EXPECT_EQ(value("strata_map_scans_pending{map=\"campus\"}"), 2);
  EXPECT_EQ(value("strata_map_pending_age_seconds{map=\"campus\"}"), 2.5);
  EXPECT_EQ(value("strata_map_scans{map=\"campus\"}"), 7);
  EXPECT_EQ(value("strata_jobs{kind=\"rebuild\",map=\"campus\",state=\"running\"}"), 1);
  EXPECT_NEAR(value("strata_uptime_seconds"), 5.0, 4.0);
  EXPECT_GT(value("strata_resident_bytes"), 1e6);
}

TEST(MetricsTest, APortInUseIsUnavailable) {
  const CallMetrics calls;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto endpoint, MetricsEndpoint::Open("127.0.0.1:0", calls, {}));
  EXPECT_THAT(MetricsEndpoint::Open(endpoint->address(), calls, {}),
              StatusIs(absl::StatusCode::kUnavailable, _));
}

}  // namespace
}  // namespace strata::server
