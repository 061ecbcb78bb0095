#include "server/options.h"

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "absl/algorithm/container.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include <unistd.h>

#include "core/common/host_port.h"

namespace strata::server {
namespace {

constexpr std::uint64_t kMebi = std::uint64_t{1} << 20;

// Where the viewer is installed, beside this program; empty: it is not.
std::filesystem::path InstalledViewer() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path folder =
      self.parent_path().parent_path() / STRATA_DATA_FOLDER / "strata" / "web";
  return std::filesystem::exists(folder, error) ? folder : std::filesystem::path();
}

// As they are written; in the units of their texts.
struct Written {
  std::string data;
  double optimize_every_s = 60.0;
  double map_idle_s = 300.0;
  double map_lease_s = 10.0;
  double upload_keep_s = 3600.0;
  double drain_s = 5.0;
  double max_query_s = 30.0;
  double upload_idle_s = 60.0;
  double slow_reader_s = 30.0;
  double max_message_mib = 4.0;
  std::uint64_t client_memory_mib = 64;
  std::uint64_t call_memory_mib = 160;
  std::uint64_t queue_mib = 64;
  std::uint64_t cache_mib = 160;
  std::uint64_t max_map_mib = 0;
  std::vector<std::string> roles = {"gateway", "integrator", "worker"};
  EngineOptions engine;
  ServerOptions server;
};

// Closed; CLI::Range takes any text for 0.
CLI::Validator Between(double low, double high, const std::string& unit) {
  const std::string range = absl::StrCat(low, " to ", high, unit.empty() ? "" : " ", unit);
  return CLI::Validator(
      [=](const std::string& text) {
        double value = 0.0;
        const bool good = absl::SimpleAtod(text, &value) && value >= low && value <= high;
        return good ? std::string() : absl::StrCat("expected ", range, ", got ", text);
      },
      "");
}

template <typename T>
void Add(CLI::App& app,
         const char* group,
         const char* name,
         T& value,
         const char* text,
         const CLI::Validator& validator) {
  app.add_option(name, value, text)->check(validator)->capture_default_str()->group(group);
}

void AddPlaces(CLI::App& app, Written& o) {
  app.add_option("--data", o.data, "Directory that holds the maps; made if absent")
      ->type_name("DIR");
  app.add_option(
         "--store",
         o.engine.store,
         "Database that holds the maps instead (PostgreSQL 15), as libpq takes it; passwords "
         "belong in a file (PGPASSFILE), not here. --data is then for files under way")
      ->type_name("postgresql://USER@HOST/DATABASE");
  app.add_option("--listen", o.server.listen, "Address to listen on; port 0 takes a free one")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  app.add_option("--metrics",
                 o.server.metrics_listen,
                 "Address that answers Prometheus at /metrics, in plain text and to anybody; none: "
                 "no metrics")
      ->type_name("HOST:PORT");
  app.add_option("--web",
                 o.server.web_listen,
                 "Address of the viewer and of the API as JSON, for browsers; under the same rules "
                 "as --listen, with its certificate and tokens; none: no web")
      ->type_name("HOST:PORT");
}

void AddWeb(CLI::App& app, Written& o) {
  constexpr char kGroup[] = "Doors";
  app.add_option("--web-name",
                 o.server.web_names,
                 "Name by which browsers reach --web, beside localhost and IP addresses; again for "
                 "more")
      ->type_name("HOST")
      ->group(kGroup);
  app.add_option_function<std::string>(
         "--web-viewer",
         [&o](const std::string& value) { o.server.web_viewer = value; },
         "Folder of the viewer that --web shows; by default the installed one, if there is one")
      ->type_name("DIR")
      ->group(kGroup);
}

void AddDoors(CLI::App& app, Written& o) {
  constexpr char kGroup[] = "Doors";
  const auto file = [&](const char* name, std::filesystem::path& path, const char* text) {
    app.add_option_function<std::string>(
           name, [&path](const std::string& value) { path = value; }, text)
        ->type_name("FILE")
        ->group(kGroup);
  };
  file("--tls-cert", o.server.tls.certificate, "Certificate of the server (PEM), then its chain");
  file("--tls-key", o.server.tls.key, "Key of the certificate (PEM, no passphrase)");
  file(
      "--tls-client-ca",
      o.server.tls.client_ca,
      "Authorities (PEM): every client must show a certificate of theirs; with --tokens its common "
      "name is that of a grant (stratad token add --certificate), unless a token is shown");
  file("--tokens", o.server.token_file, "Who may do what; see stratad token add. Absent: anybody");
  app.add_flag("--insecure",
               o.server.insecure,
               "Listen beyond loopback without TLS, or without tokens and client certificates")
      ->group(kGroup);
}

void AddClientLimits(CLI::App& app, Written& o) {
  constexpr char kGroup[] = "Limits of one client (a name of --tokens, or an address)";
  ClientLimitOptions& client = o.server.client;
  const CLI::Validator count = Between(1, 1e6, "");
  Add(app, kGroup, "--client-calls", client.max_calls, "Calls under way", count);
  Add(app, kGroup, "--client-watches", client.max_watches, "Watches under way", count);
  Add(app,
      kGroup,
      "--client-rate",
      client.calls_per_second,
      "Calls begun a second [1/s], in the long run; 0: any number",
      Between(0, 1e6, "calls/s"));
  Add(app,
      kGroup,
      "--client-burst",
      client.burst,
      "Calls begun at once after a pause, with --client-rate",
      Between(1, 1e6, "calls"));
  Add(app,
      kGroup,
      "--client-memory",
      o.client_memory_mib,
      "What its calls may hold in memory: requests, uploads on their way, answers not taken [MiB]",
      Between(1, 1 << 20, "MiB"));
  Add(app,
      kGroup,
      "--max-message",
      o.max_message_mib,
      "Size of one request [MiB]; chunks of points of the SDK take below 1",
      Between(0.0625, 64, "MiB"));
  Add(app,
      kGroup,
      "--max-scan-points",
      o.engine.max_points_per_scan,
      "Points of one scan",
      Between(1, 1e10, "points"));
  Add(app,
      kGroup,
      "--upload-idle",
      o.upload_idle_s,
      "How long a stream of requests may bring nothing [s]",
      Between(0.1, 86400, "s"));
  Add(app,
      kGroup,
      "--slow-reader",
      o.slow_reader_s,
      "How long the reader of a stream may take nothing, or less than 32 KiB/s [s]",
      Between(0.1, 86400, "s"));
}

void AddServerLimits(CLI::App& app, Written& o) {
  constexpr char kGroup[] = "Limits of the server";
  const CLI::Validator threads = Between(1, 1000, "threads");
  const CLI::Validator count = Between(1, 1e6, "");
  Add(app,
      kGroup,
      "--max-calls",
      o.server.max_calls,
      "Calls under way before clients are sent away",
      count);
  Add(app,
      kGroup,
      "--max-watches",
      o.server.max_watches,
      "Watches of maps and jobs under way before more are sent away; they are no calls",
      count);
  Add(app,
      kGroup,
      "--call-memory",
      o.call_memory_mib,
      "What the calls of all clients together may hold in memory [MiB]; beside --cache and --queue",
      Between(1, 1 << 20, "MiB"));
  Add(app, kGroup, "--query-threads", o.server.query_threads, "Calls answered at a time", threads);
  Add(app,
      kGroup,
      "--stream-threads",
      o.server.stream_threads,
      "Downloads served at a time",
      threads);
  Add(app,
      kGroup,
      "--upload-threads",
      o.server.upload_threads,
      "Scans taken in at a time",
      threads);
  Add(app,
      kGroup,
      "--max-query-time",
      o.max_query_s,
      "How long a call that only reads may take, but for downloads and watches [s]",
      Between(0.1, 86400, "s"));
  Add(app,
      kGroup,
      "--drain",
      o.drain_s,
      "How long calls may take to end at shutdown [s]",
      Between(0, 3600, "s"));
}

void AddMapLimits(CLI::App& app, Written& o) {
  constexpr char kGroup[] = "Maps";
  const CLI::Validator mebi = Between(1, 1 << 20, "MiB");
  Add(app, kGroup, "--max-maps", o.engine.max_maps, "Maps there may be", Between(1, 1e6, "maps"));
  Add(app,
      kGroup,
      "--max-open-maps",
      o.engine.max_open_maps,
      "Maps that are open at a time, each with three threads; others are opened when they are "
      "asked "
      "for, in place of one that is not in use",
      Between(1, 1e6, "maps"));
  Add(app,
      kGroup,
      "--map-idle",
      o.map_idle_s,
      "A map that nobody has used for so long [s], and that has nothing to do, is closed until "
      "somebody asks for it",
      Between(0, 1e9, "s"));
  Add(app,
      kGroup,
      "--max-map-size",
      o.max_map_mib,
      "Size of a map's file [MiB]; 0: what the disk holds",
      Between(0, 1 << 30, "MiB"));
  Add(app,
      kGroup,
      "--max-pending-scans",
      o.engine.max_pending_scans,
      "Acknowledged scans of a map that may wait to be joined into it before more are sent away",
      Between(1, 1e9, "scans"));
  Add(app,
      kGroup,
      "--queue",
      o.queue_mib,
      "Points of a map that may wait for the disk [MiB]",
      mebi);
  Add(app,
      kGroup,
      "--cache",
      o.cache_mib,
      "What is kept in memory of all maps together: tiles, features, what planning prepares [MiB]",
      mebi);
  Add(app,
      kGroup,
      "--optimize-every",
      o.optimize_every_s,
      "After a loop was closed, and at most so often [s], optimize a map's poses without being "
      "asked; 0: never",
      Between(0, 86400, "s"));
  Add(app,
      kGroup,
      "--upload-keep",
      o.upload_keep_s,
      "How long the points of an announced scan whose upload broke off stay for its client to go "
      "on "
      "with [s]",
      Between(0, 86400, "s"));
}

void AddSharing(CLI::App& app, Written& o) {
  constexpr char kGroup[] = "Several servers on one --store";
  app.add_option(
         "--role",
         o.roles,
         "What this server does: each answers calls (gateway); an integrator takes maps, joins "
         "scans into them and changes their tiles and poses; a worker runs jobs that leave "
         "that to it, of any map")
      ->type_name("gateway,integrator,worker")
      ->delimiter(',')
      ->check(CLI::IsMember({"gateway", "integrator", "worker"}).description(""))
      ->group(kGroup);
  app.add_option(
         "--server-name",
         o.engine.server_name,
         "What other servers call this one; where it is HOST:PORT, clients that know one of "
         "them only go there for the maps that this one has. By default the machine's name "
         "and the port of --listen")
      ->type_name("NAME")
      ->group(kGroup);
  Add(app,
      kGroup,
      "--map-lease",
      o.map_lease_s,
      "How long this server, once it is dead or cut off from the store, keeps its maps from the "
      "others [s]",
      Between(1, 3600, "s"));
}

// Names that tell servers apart, and are no addresses: whether clients reach the machine by its
// name is not known here.
std::string DefaultServerName(const std::string& listen) {
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host.front() = 0;
  const absl::StatusOr<HostPort> address = ParseHostPort(listen);
  if (address.ok() && address->port != 0) return absl::StrCat(host.data(), "/", address->port);
  return absl::StrCat(host.data(), " process ", getpid());
}

absl::StatusOr<ProgramOptions> Read(const Written& o) {
  if (o.data.empty()) {
    return absl::InvalidArgumentError("--data is missing: the directory that holds the maps");
  }
  ProgramOptions options{o.engine, o.server};
  options.engine.directory = o.data;
  options.engine.queue_bytes = o.queue_mib * kMebi;
  options.engine.cache_bytes = o.cache_mib * kMebi;
  options.engine.max_map_bytes = o.max_map_mib * kMebi;
  options.engine.optimize_interval = absl::Seconds(o.optimize_every_s);
  options.engine.upload_keep = absl::Seconds(o.upload_keep_s);
  options.engine.map_idle = absl::Seconds(o.map_idle_s);
  options.engine.map_lease = absl::Seconds(o.map_lease_s);
  options.engine.integrates = absl::c_linear_search(o.roles, "integrator");
  options.engine.works = absl::c_linear_search(o.roles, "worker");
  const bool all = options.engine.integrates && options.engine.works;
  if (!all && options.engine.store.empty()) {
    return absl::InvalidArgumentError(
        "--role leaves something out, but nobody else can have the maps of --data; name --store");
  }
  if (options.engine.server_name.empty()) {
    options.engine.server_name = DefaultServerName(o.server.listen);
  }
  if (options.server.web_viewer.empty()) options.server.web_viewer = InstalledViewer();
  options.server.drain_timeout = absl::Seconds(o.drain_s);
  options.server.max_query_time = absl::Seconds(o.max_query_s);
  options.server.slow_sender_timeout = absl::Seconds(o.upload_idle_s);
  options.server.slow_reader_timeout = absl::Seconds(o.slow_reader_s);
  options.server.client.max_bytes = o.client_memory_mib * kMebi;
  options.server.max_call_bytes = o.call_memory_mib * kMebi;
  options.server.max_message_bytes =
      static_cast<int>(o.max_message_mib * static_cast<double>(kMebi));
  return options;
}

}  // namespace

std::function<absl::StatusOr<ProgramOptions>()> AddServeOptions(CLI::App& app) {
  const auto written = std::make_shared<Written>();
  app.set_config("--config", "", "Options in a file, one a line: listen = 127.0.0.1:50051")
      ->type_name("FILE");
  app.allow_config_extras(CLI::config_extras_mode::error);
  AddPlaces(app, *written);
  AddDoors(app, *written);
  AddWeb(app, *written);
  AddClientLimits(app, *written);
  AddServerLimits(app, *written);
  AddMapLimits(app, *written);
  AddSharing(app, *written);
  return [written] { return Read(*written); };
}

}  // namespace strata::server
