#include "server/web/session.h"

#include <algorithm>
#include <deque>
#include <optional>
#include <type_traits>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/status.hpp>
#include <boost/beast/http/string_body.hpp>

#include "proto/translate/status.h"

namespace strata::server::web {
namespace {

namespace net = boost::asio;
namespace http = boost::beast::http;
using boost::system::error_code;
using net::ip::tcp;
using TlsStream = net::ssl::stream<tcp::socket>;
using Parser = http::request_parser<http::string_body>;

// What may come in behind a request before its answer has gone out. Of a client that sends more
// nobody would notice when it goes.
constexpr std::size_t kAheadBytes = 64 << 10;
constexpr std::size_t kAheadRead = 512;
// An answer, or a piece of one, of more is booked until it is written.
constexpr std::size_t kSmallAnswerBytes = 16 << 10;
// After a connection's last answer: what is still on its way in is thrown away, since closing
// before would throw away the answer.
constexpr absl::Duration kLingerTime = absl::Seconds(2);
constexpr std::size_t kLingerBytes = 16 << 20;
// Of a reader that takes something.
constexpr double kLeastBytesPerSecond = 32 << 10;

constexpr char kFixedHeaders[] =
    "X-Content-Type-Options: nosniff\r\n"
    "Content-Security-Policy: default-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'; object-src 'none'\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Referrer-Policy: no-referrer\r\n";

std::string PeerName(const tcp::socket& socket) {
  error_code error;
  const tcp::endpoint peer = socket.remote_endpoint(error);
  if (error) return "unknown";
  const std::string address = peer.address().to_string();
  return peer.address().is_v4() ? absl::StrCat("ipv4:", address, ":", peer.port())
                                : absl::StrCat("ipv6:%5B", address, "%5D:", peer.port());
}

std::string HeadText(const Answer& answer, absl::string_view length, bool keep) {
  const auto reason = http::obsolete_reason(http::int_to_status(answer.status));
  std::string text = absl::StrCat("HTTP/1.1 ",
                                  answer.status,
                                  " ",
                                  absl::string_view(reason.data(), reason.size()),
                                  "\r\n",
                                  kFixedHeaders);
  for (const auto& [name, value] : answer.headers)
    absl::StrAppend(&text, name, ": ", value, "\r\n");
  absl::StrAppend(&text, length, keep ? "" : "Connection: close\r\n", "\r\n");
  return text;
}

Question QuestionOf(const http::request<http::string_body>& request, const std::string& peer) {
  const auto view = [](boost::beast::string_view text) {
    return absl::string_view(text.data(), text.size());
  };
  Question question;
  question.verb = std::string(view(request.method_string()));
  const absl::string_view target = view(request.target());
  const std::size_t mark = std::min(target.find('?'), target.size());
  question.path = std::string(target.substr(0, mark));
  if (mark < target.size()) question.query = std::string(target.substr(mark + 1));
  for (const auto& field : request) {
    std::string& value = question.headers[absl::AsciiStrToLower(view(field.name_string()))];
    // Of two that differ neither is believed: no host has a comma.
    value = value.empty() ? std::string(view(field.value()))
                          : absl::StrCat(value, ",", view(field.value()));
  }
  question.peer = peer;
  return question;
}

template <typename Stream>
class HttpSession final : public Session,
                          public AnswerSink,
                          public std::enable_shared_from_this<HttpSession<Stream>> {
 public:
  static constexpr bool kTls = std::is_same_v<Stream, TlsStream>;

  HttpSession(tcp::socket socket,
              std::shared_ptr<net::ssl::context> tls,
              const SessionShared& shared)
      : shared_(shared),
        peer_(PeerName(socket)),
        tls_(std::move(tls)),
        strand_(net::make_strand(socket.get_executor())),
        timer_(strand_),
        stream_(MakeStream(std::move(socket), tls_.get())) {}
  ~HttpSession() override { GiveBytes(); }

  void Start() override {
    Post([](HttpSession& self) { self.Shake(); });
  }
  void Close() override {
    Post([](HttpSession& self) { self.CloseNow(); });
  }
  void Send(Answer answer) override {
    Post([answer = std::move(answer)](HttpSession& self) mutable {
      self.SendNow(std::move(answer));
    });
  }
  void Begin(Answer head) override {
    Post([head = std::move(head)](HttpSession& self) {
      self.Queue(HeadText(head, "Transfer-Encoding: chunked\r\n", self.keep_), {}, false);
    });
  }
  void Write(std::string piece, std::function<void()> taken) override {
    Post([piece = std::move(piece), taken = std::move(taken)](HttpSession& self) mutable {
      self.Queue(ChunkText(piece), std::move(taken), false);
    });
  }
  void End(std::string last) override {
    Post([last = std::move(last)](HttpSession& self) {
      self.Queue(absl::StrCat(ChunkText(last), "0\r\n\r\n"), {}, true);
    });
  }

 private:
  struct Piece {
    std::string text;
    std::function<void()> taken;
    bool last = false;
    std::size_t booked = 0;
  };

  static Stream MakeStream(tcp::socket socket, net::ssl::context* tls) {
    if constexpr (kTls) {
      return Stream(std::move(socket), *tls);
    } else {
      return socket;
    }
  }
  static std::string ChunkText(const std::string& piece) {
    if (piece.empty()) return "";
    return absl::StrCat(absl::Hex(piece.size()), "\r\n", piece, "\r\n");
  }

  auto& Lowest() { return stream_.lowest_layer(); }
  // On the strand, unless it has ended.
  template <typename Work>
  void Post(Work work) {
    net::post(strand_, [self = this->shared_from_this(), work = std::move(work)]() mutable {
      if (!self->closed_) work(*self);
    });
  }
  // A handler of an operation: on the strand; an error ends the session.
  template <typename Next>
  auto Then(Next next) {
    return net::bind_executor(
        strand_, [self = this->shared_from_this(), next](error_code error, std::size_t bytes = 0) {
          if (self->closed_) return;
          next(*self, error, bytes);
        });
  }

  void Arm(absl::Duration patience);
  void Disarm();
  void Shake();
  void ReadHead(absl::Duration patience);
  void OnHead();
  bool BookBody();
  void Continue();
  void ReadBody();
  void OnBody();
  void OnReadError(error_code error);
  void ReadAhead();
  void OnAhead(error_code error, std::size_t bytes);
  void Refuse(Answer answer);
  void SendNow(Answer answer);
  bool BookAnswer(std::size_t bytes);
  void Queue(std::string text, std::function<void()> taken, bool last);
  void Push(Piece piece);
  void WriteFirst();
  void OnWritten();
  void OnAnswered();
  void CloseNow();
  void GiveBytes();

  const SessionShared& shared_;
  const std::string peer_;
  const std::shared_ptr<net::ssl::context> tls_;
  net::strand<tcp::socket::executor_type> strand_;
  net::steady_timer timer_;
  Stream stream_;
  boost::beast::flat_buffer buffer_;
  std::optional<Parser> parser_;
  Question question_;
  std::shared_ptr<Exchange> exchange_;
  std::deque<Piece> pieces_;  // the first is being written
  std::size_t booked_ = 0;
  std::size_t lingered_ = 0;
  std::uint64_t armed_ = 0;
  bool keep_ = true;        // for a next request
  bool head_only_ = false;  // HEAD
  bool reading_ahead_ = false;
  bool waiting_for_ahead_ = false;  // the next request begins when that read ends
  bool lingering_ = false;
  bool closed_ = false;
};

template <typename Stream>
void HttpSession<Stream>::Arm(absl::Duration patience) {
  const std::uint64_t armed = ++armed_;
  timer_.expires_after(absl::ToChronoNanoseconds(patience));
  timer_.async_wait(Then([armed](HttpSession& self, error_code error, std::size_t /*bytes*/) {
    if (!error && armed == self.armed_) self.CloseNow();
  }));
}

template <typename Stream>
void HttpSession<Stream>::Disarm() {
  ++armed_;
  timer_.cancel();
}

template <typename Stream>
void HttpSession<Stream>::Shake() {
  if constexpr (kTls) {
    Arm(shared_.limits.header_time);
    stream_.async_handshake(net::ssl::stream_base::server,
                            Then([](HttpSession& self, error_code error, std::size_t /*bytes*/) {
                              if (error) return self.CloseNow();
                              self.ReadHead(self.shared_.limits.header_time);
                            }));
  } else {
    ReadHead(shared_.limits.header_time);
  }
}

template <typename Stream>
void HttpSession<Stream>::ReadHead(absl::Duration patience) {
  shared_.sessions.SetWaiting(this, true);
  parser_.emplace();
  parser_->header_limit(static_cast<std::uint32_t>(shared_.limits.header_bytes));
  parser_->body_limit(shared_.limits.body_bytes + kEnvelopeBytes);
  Arm(patience);
  http::async_read_header(stream_,
                          buffer_,
                          *parser_,
                          Then([](HttpSession& self, error_code error, std::size_t /*bytes*/) {
                            if (error) return self.OnReadError(error);
                            self.OnHead();
                          }));
}

template <typename Stream>
void HttpSession<Stream>::OnHead() {
  question_ = QuestionOf(parser_->get(), peer_);
  keep_ = parser_->get().keep_alive() && parser_->get().version() == 11;
  head_only_ = question_.verb == "HEAD";
  if (std::optional<Answer> refused = shared_.router.Refuse(question_); refused.has_value()) {
    return Refuse(*std::move(refused));
  }
  if (!BookBody()) return;
  if (absl::EqualsIgnoreCase(question_.Header("expect"), "100-continue")) return Continue();
  ReadBody();
}

// Who sends much is asked who he is before it is read.
template <typename Stream>
bool HttpSession<Stream>::BookBody() {
  const auto length = parser_->content_length();
  const std::size_t bytes = length               ? static_cast<std::size_t>(*length)
                            : parser_->chunked() ? shared_.limits.body_bytes
                                                 : 0;
  if (bytes <= shared_.limits.small_body_bytes) return true;
  const absl::Status known = shared_.known(question_.Header("authorization"));
  if (!known.ok()) {
    Refuse(ErrorAnswer(translate::ToGrpcStatus(known, "")));
    return false;
  }
  if (!shared_.sessions.TakeBytes(bytes)) {
    Refuse(ErrorAnswer(translate::ToGrpcStatus(
        translate::WithReason(absl::ResourceExhaustedError(
                                  "too many large requests are on their way in; try again later"),
                              translate::kServerBusyReason),
        "")));
    return false;
  }
  booked_ = bytes;
  return true;
}

template <typename Stream>
void HttpSession<Stream>::Continue() {
  static constexpr char kContinue[] = "HTTP/1.1 100 Continue\r\n\r\n";
  net::async_write(stream_,
                   net::buffer(kContinue, sizeof(kContinue) - 1),
                   Then([](HttpSession& self, error_code error, std::size_t /*bytes*/) {
                     if (error) return self.CloseNow();
                     self.ReadBody();
                   }));
}

template <typename Stream>
void HttpSession<Stream>::ReadBody() {
  Arm(shared_.limits.body_time);
  http::async_read(stream_,
                   buffer_,
                   *parser_,
                   Then([](HttpSession& self, error_code error, std::size_t /*bytes*/) {
                     if (error) return self.OnReadError(error);
                     self.OnBody();
                   }));
}

template <typename Stream>
void HttpSession<Stream>::OnBody() {
  Disarm();
  shared_.sessions.SetWaiting(this, false);
  question_.body = std::move(parser_->get().body());
  exchange_ = shared_.router.Handle(question_, this->shared_from_this());
  question_ = Question();
  GiveBytes();
  buffer_.shrink_to_fit();
  ReadAhead();
}

// What can be told to whoever sent what is no request, or too much.
template <typename Stream>
void HttpSession<Stream>::OnReadError(error_code error) {
  if (error == http::error::body_limit) {
    return Refuse(ErrorAnswer(
        413,
        grpc::RESOURCE_EXHAUSTED,
        absl::StrCat(
            "the body has more than ", shared_.limits.body_bytes, " bytes (--max-message)")));
  }
  if (error == http::error::header_limit) {
    return Refuse(ErrorAnswer(
        431,
        grpc::RESOURCE_EXHAUSTED,
        absl::StrCat("the header has more than ", shared_.limits.header_bytes, " bytes")));
  }
  const bool is_http =
      error.category() == http::make_error_code(http::error::end_of_stream).category();
  if (is_http && error != http::error::end_of_stream && error != http::error::partial_message) {
    return Refuse(ErrorAnswer(
        400, grpc::INVALID_ARGUMENT, absl::StrCat("no request of HTTP: ", error.message())));
  }
  CloseNow();
}

// Meanwhile: how the end of the connection is noticed.
template <typename Stream>
void HttpSession<Stream>::ReadAhead() {
  if (reading_ahead_) return;
  if (buffer_.size() > kAheadBytes) return CloseNow();
  reading_ahead_ = true;
  stream_.async_read_some(buffer_.prepare(kAheadRead),
                          Then([](HttpSession& self, error_code error, std::size_t bytes) {
                            self.reading_ahead_ = false;
                            self.OnAhead(error, bytes);
                          }));
}

template <typename Stream>
void HttpSession<Stream>::OnAhead(error_code error, std::size_t bytes) {
  if (error == net::error::operation_aborted && std::exchange(waiting_for_ahead_, false)) {
    return ReadHead(shared_.limits.header_time);  // it is in the buffer
  }
  if (error) return CloseNow();
  if (lingering_) {
    lingered_ += bytes;
    if (lingered_ > kLingerBytes) return CloseNow();
    return ReadAhead();
  }
  buffer_.commit(bytes);
  if (std::exchange(waiting_for_ahead_, false)) return ReadHead(shared_.limits.header_time);
  ReadAhead();
}

// The rest of the request is not read.
template <typename Stream>
void HttpSession<Stream>::Refuse(Answer answer) {
  keep_ = false;
  SendNow(std::move(answer));
}

template <typename Stream>
void HttpSession<Stream>::SendNow(Answer answer) {
  // Answers that nobody takes are memory; the services' own books end when the door has them.
  if (!BookAnswer(answer.body.size())) {
    answer = ErrorAnswer(translate::ToGrpcStatus(
        translate::WithReason(
            absl::ResourceExhaustedError("too many answers wait to be taken; try again later"),
            translate::kServerBusyReason),
        ""));
  }
  const bool bare = answer.status == 304;
  std::string text = HeadText(
      answer, bare ? "" : absl::StrCat("Content-Length: ", answer.body.size(), "\r\n"), keep_);
  if (!head_only_ && !bare) text += answer.body;
  Push({std::move(text), {}, true, std::exchange(booked_, 0)});
}

template <typename Stream>
bool HttpSession<Stream>::BookAnswer(std::size_t bytes) {
  GiveBytes();
  if (bytes <= kSmallAnswerBytes) return true;
  if (!shared_.sessions.TakeBytes(bytes)) return false;
  booked_ = bytes;
  return true;
}

// A piece of a stream; what was told before is no answer without it.
template <typename Stream>
void HttpSession<Stream>::Queue(std::string text, std::function<void()> taken, bool last) {
  if (!BookAnswer(text.size())) return CloseNow();
  Push({std::move(text), std::move(taken), last, std::exchange(booked_, 0)});
}

template <typename Stream>
void HttpSession<Stream>::Push(Piece piece) {
  pieces_.push_back(std::move(piece));
  if (pieces_.size() == 1) WriteFirst();
}

template <typename Stream>
void HttpSession<Stream>::WriteFirst() {
  const std::string& text = pieces_.front().text;
  Arm(shared_.limits.write_time +
      absl::Seconds(static_cast<double>(text.size()) / kLeastBytesPerSecond));
  net::async_write(stream_,
                   net::buffer(text),
                   Then([](HttpSession& self, error_code error, std::size_t /*bytes*/) {
                     if (error) return self.CloseNow();
                     self.OnWritten();
                   }));
}

template <typename Stream>
void HttpSession<Stream>::OnWritten() {
  Disarm();
  const Piece piece = std::move(pieces_.front());
  pieces_.pop_front();
  if (piece.booked > 0) shared_.sessions.GiveBytes(piece.booked);
  if (!pieces_.empty()) WriteFirst();
  if (piece.taken) piece.taken();
  if (piece.last) OnAnswered();
}

template <typename Stream>
void HttpSession<Stream>::OnAnswered() {
  exchange_.reset();
  GiveBytes();
  if (!keep_) {
    lingering_ = true;
    Arm(kLingerTime);
    error_code ignored;
    if constexpr (!kTls) Lowest().shutdown(tcp::socket::shutdown_send, ignored);
    buffer_.clear();
    return ReadAhead();
  }
  if (!reading_ahead_) return ReadHead(shared_.limits.idle_time);
  shared_.sessions.SetWaiting(this, true);
  waiting_for_ahead_ = true;
  Arm(shared_.limits.idle_time);
  error_code ignored;
  if (buffer_.size() > 0) Lowest().cancel(ignored);
}

template <typename Stream>
void HttpSession<Stream>::CloseNow() {
  closed_ = true;
  timer_.cancel();
  error_code ignored;
  Lowest().shutdown(tcp::socket::shutdown_both, ignored);
  Lowest().close(ignored);
  if (exchange_ != nullptr) std::exchange(exchange_, nullptr)->Cancel();
  for (Piece& piece : pieces_) {
    if (piece.booked > 0) shared_.sessions.GiveBytes(std::exchange(piece.booked, 0));
  }
  if (pieces_.size() > 1)
    pieces_.erase(pieces_.begin() + 1, pieces_.end());  // one is being written
  GiveBytes();
  shared_.sessions.Remove(this);
}

template <typename Stream>
void HttpSession<Stream>::GiveBytes() {
  if (booked_ > 0) shared_.sessions.GiveBytes(std::exchange(booked_, 0));
}

}  // namespace

std::shared_ptr<Session> MakeSession(tcp::socket socket,
                                     std::shared_ptr<net::ssl::context> tls,
                                     const SessionShared& shared) {
  if (tls == nullptr) {
    return std::make_shared<HttpSession<tcp::socket>>(std::move(socket), nullptr, shared);
  }
  return std::make_shared<HttpSession<TlsStream>>(std::move(socket), std::move(tls), shared);
}

}  // namespace strata::server::web
