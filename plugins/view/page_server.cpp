#include "plugins/view/page_server.h"

#include <algorithm>
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "core/base/error.h"

namespace sim {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using boost::system::error_code;
using Request = http::request<http::empty_body>;

constexpr std::size_t kMostHeader = 8192;   // bytes of a request
constexpr std::size_t kMostRequests = 64;   // connections that have not shown the token
constexpr std::size_t kMostDownloads = 16;  // of the page at once
constexpr std::size_t kMostClients = 16;    // pages that are open
constexpr std::size_t kMostPending = 16;    // messages of a client that wait to be taken
constexpr std::size_t kMostAnswers = 64;    // texts that wait to be sent to a client
constexpr int kInFlight = 2;                // frames that a page has not yet drawn
constexpr int kMostHandlers = 400;          // events that are handled in one wait()
constexpr std::chrono::seconds kHeaderTime{5}, kDownloadTime{30}, kIdleTime{120};
constexpr std::chrono::milliseconds kAcceptPause{50};  // after a failure, such as no descriptors

std::string_view std_view(beast::string_view text) { return {text.data(), text.size()}; }

std::string_view header(const Request& request, http::field name) {
  return std_view(request[name]);
}

// A name of this machine, with any port: a tunnel may have another one.
bool is_local(std::string_view host) {
  const std::size_t end = host.find_last_not_of("0123456789");
  if (end != std::string_view::npos && end + 1 < host.size() && host[end] == ':')
    host = host.substr(0, end);
  return host == "127.0.0.1" || host == "localhost" || host == "[::1]";
}

// The page's WebSocket as a source of its policy: not every browser counts it as 'self'. A policy
// has no IPv6 addresses.
std::string socket_source(std::string_view host) {
  return host.starts_with('[') ? "" : " ws://" + std::string(host);
}

enum class Wanted { kNothing, kPage, kSocket };

Wanted wanted(const Request& request, const std::string& token) {
  using Field = http::field;
  constexpr Field kOfBodies[] = {Field::content_length, Field::transfer_encoding, Field::expect,
                                 Field::trailer};
  const bool body = std::ranges::any_of(kOfBodies, [&](Field f) { return request.count(f) > 0; });
  const std::string_view host = header(request, Field::host), target = std_view(request.target());
  if (request.method() != http::verb::get || request.version() != 11 || body ||
      request.count(Field::host) != 1 || !is_local(host))
    return Wanted::kNothing;
  if (target == "/" + token + "/")
    return request.count(Field::upgrade) == 0 ? Wanted::kPage : Wanted::kNothing;
  const bool upgrade =
      target == "/" + token + "/socket" && websocket::is_upgrade(request) &&
      request.count(Field::upgrade) == 1 && beast::iequals(request[Field::upgrade], "websocket") &&
      request.count(Field::sec_websocket_version) == 1 &&
      header(request, Field::sec_websocket_version) == "13" &&
      request.count(Field::sec_websocket_key) == 1 && request.count(Field::origin) == 1 &&
      header(request, Field::origin) == "http://" + std::string(host);
  return upgrade ? Wanted::kSocket : Wanted::kNothing;
}

// The connection of a page that is open.
class Client final : public std::enable_shared_from_this<Client> {
 public:
  explicit Client(tcp::socket socket) : stream_(std::move(socket)) {
    websocket::stream_base::timeout limits{};
    limits.handshake_timeout = kHeaderTime;
    limits.idle_timeout = kIdleTime;
    limits.keep_alive_pings = true;
    stream_.set_option(limits);
    stream_.read_message_max(View::kMostText);
    stream_.auto_fragment(false);
  }

  void accept(const Request& request) {
    stream_.async_accept(request, [self = shared_from_this()](error_code failed) {
      self->open_ = !failed;
      self->gone_ = !!failed;
      if (failed) return;
      self->read();
      self->write();
    });
  }

  // The handshake, and a close frame that says why.
  void refuse(const Request& request, const std::string& why) {
    stream_.async_accept(request, [self = shared_from_this(), why](error_code failed) {
      if (failed) return;
      const websocket::close_reason reason(websocket::close_code::try_again_later, why);
      self->stream_.async_close(reason, [self](error_code) {});
    });
  }

  bool gone() const { return gone_ && inbox_.empty(); }
  bool wants_frame() const { return open_ && !gone_ && !frame_ && in_flight_ < kInFlight; }
  bool has_message() const { return !inbox_.empty(); }
  bool take_newcomer() { return std::exchange(newcomer_, false); }

  std::string take_message() {
    std::string text = std::move(inbox_.front());
    inbox_.pop_front();
    read();
    return text;
  }

  void show(std::shared_ptr<const std::string> frame) {
    frame_ = std::move(frame);
    write();
  }

  void answer(std::string text) {
    if (answers_.size() < kMostAnswers) answers_.push_back(std::move(text));
    write();
  }

 private:
  void read() {
    if (!open_ || gone_ || reading_ || inbox_.size() >= kMostPending) return;
    reading_ = true;
    stream_.async_read(buffer_, [self = shared_from_this()](error_code failed, std::size_t) {
      self->reading_ = false;
      if (failed || !self->stream_.got_text()) return self->leave();
      self->receive(beast::buffers_to_string(self->buffer_.data()));
      self->buffer_.consume(self->buffer_.size());
      self->read();
    });
  }

  void receive(std::string text) {
    if (text == "drawn")
      in_flight_ = std::max(0, in_flight_ - 1);
    else if (text == "hello")
      newcomer_ = true;
    else
      inbox_.push_back(std::move(text));
  }

  void write() {
    if (!open_ || gone_ || writing_ || (answers_.empty() && !frame_)) return;
    writing_ = true;
    const bool text = !answers_.empty();
    if (text) {
      sent_ = std::make_shared<const std::string>(std::move(answers_.front()));
      answers_.pop_front();
    } else {
      sent_ = std::exchange(frame_, nullptr);
      ++in_flight_;
    }
    stream_.text(text);
    stream_.async_write(asio::buffer(*sent_),
                        [self = shared_from_this()](error_code failed, std::size_t) {
                          self->writing_ = false;
                          self->sent_.reset();
                          if (failed) return self->leave();
                          self->write();
                        });
  }

  void leave() {
    gone_ = true;
    beast::close_socket(beast::get_lowest_layer(stream_));
  }

  websocket::stream<beast::tcp_stream> stream_;
  beast::flat_buffer buffer_;
  std::deque<std::string> inbox_, answers_;
  std::shared_ptr<const std::string> frame_, sent_;
  bool open_ = false, gone_ = false, reading_ = false, writing_ = false, newcomer_ = false;
  int in_flight_ = 0;
};

// A connection until its request has been judged, and the page is sent.
struct HttpConnection {
  explicit HttpConnection(tcp::socket socket) : stream(std::move(socket)), buffer(kMostHeader) {
    parser.header_limit(kMostHeader);
    parser.body_limit(0);
  }

  beast::tcp_stream stream;
  beast::flat_buffer buffer;
  http::request_parser<http::empty_body> parser;
  std::shared_ptr<const std::string> page;  // while it is sent
  http::response<http::span_body<const char>> response;
};

}  // namespace

class PageServer::Impl {
 public:
  Impl(std::string token, int port) : token_(std::move(token)) {
    port_ = listen("127.0.0.1", port);
    if (port_ > 0) listen("::1", port_);  // if the port is free there
  }

  // The port, or 0.
  int listen(const char* address, int port) {
    auto acceptor = std::make_unique<tcp::acceptor>(context_);
    const tcp::endpoint at(asio::ip::make_address(address), static_cast<unsigned short>(port));
    error_code failed;
    if (port < 0 || port > 65535 || acceptor->open(at.protocol(), failed)) return 0;
    acceptor->set_option(tcp::acceptor::reuse_address(true), failed);
    if (at.address().is_v6()) acceptor->set_option(asio::ip::v6_only(true), failed);
    if (acceptor->bind(at, failed) || acceptor->listen(64, failed)) return 0;
    const int found = acceptor->local_endpoint(failed).port();
    accept(*acceptors_.emplace_back(std::move(acceptor)));
    return failed ? 0 : found;
  }

  void accept(tcp::acceptor& acceptor) {
    acceptor.async_accept(context_, [this, &acceptor](error_code failed, tcp::socket socket) {
      if (failed == asio::error::operation_aborted) return;
      if (failed) return pause(acceptor);
      socket.set_option(tcp::no_delay(true), failed);
      read_request(std::make_shared<HttpConnection>(std::move(socket)));
      accept(acceptor);
    });
  }

  void pause(tcp::acceptor& acceptor) {
    const auto timer = std::make_shared<asio::steady_timer>(context_, kAcceptPause);
    timer->async_wait([this, timer, &acceptor](error_code failed) {
      if (!failed) accept(acceptor);
    });
  }

  // Reads one request. The oldest connection that has shown no token makes room for a new one.
  void read_request(const std::shared_ptr<HttpConnection>& connection) {
    while (requests_.size() >= kMostRequests) {
      beast::close_socket(requests_.front()->stream);
      requests_.pop_front();
    }
    requests_.push_back(connection);
    connection->stream.expires_after(kHeaderTime);
    http::async_read_header(connection->stream, connection->buffer, connection->parser,
                            [this, connection](error_code failed, std::size_t) {
                              std::erase(requests_, connection);
                              if (!failed) serve(connection);
                            });
  }

  // A connection is closed where nothing holds it any more.
  void serve(const std::shared_ptr<HttpConnection>& connection) {
    const Request& request = connection->parser.get();
    const bool more = connection->buffer.size() > 0;  // of a body or another request
    const Wanted what = more ? Wanted::kNothing : wanted(request, token_);
    if (what != Wanted::kSocket) return respond(connection, what == Wanted::kPage);
    const bool full = clients_.size() >= kMostClients;
    connection->stream.expires_never();
    const auto client = std::make_shared<Client>(connection->stream.release_socket());
    if (full) return client->refuse(request, kFull);
    clients_.emplace(next_id_++, client);
    client->accept(request);
  }

  void respond(const std::shared_ptr<HttpConnection>& connection, bool allowed) {
    auto& response = connection->response;
    allowed = allowed && page_ && downloads_ < kMostDownloads;
    response.version(11);
    response.result(allowed ? http::status::ok : http::status::forbidden);
    response.keep_alive(false);
    response.set(http::field::cache_control, "no-store");
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Referrer-Policy", "no-referrer");
    response.set("X-Frame-Options", "DENY");
    response.set("Content-Security-Policy",
                 (allowed ? policy_ + "; connect-src 'self'" +
                                socket_source(header(connection->parser.get(), http::field::host))
                          : "default-src 'none'") +
                     "; frame-ancestors 'none'");
    if (allowed) {
      connection->page = page_;
      response.set(http::field::content_type, "text/html; charset=utf-8");
      response.body() = {page_->data(), page_->size()};
      ++downloads_;
    }
    response.prepare_payload();
    connection->stream.expires_after(allowed ? kDownloadTime : kHeaderTime);
    http::async_write(connection->stream, response,
                      [this, connection, allowed](error_code failed, std::size_t) {
                        downloads_ -= allowed ? 1 : 0;
                        connection->stream.socket().shutdown(tcp::socket::shutdown_send, failed);
                      });
  }

  std::vector<ViewMessage> wait(int milliseconds) {
    const bool any = !held_ && std::ranges::any_of(clients_, [](const auto& each) {
      return each.second->has_message();
    });
    context_.restart();
    if (!any && milliseconds > 0) context_.run_one_for(std::chrono::milliseconds(milliseconds));
    for (int i = 0; i < kMostHandlers && context_.poll_one() > 0; ++i) {}
    std::vector<ViewMessage> messages;
    if (held_) return messages;
    for (auto& [id, client] : clients_)
      if (client->has_message()) messages.push_back({id, client->take_message()});
    std::erase_if(clients_, [&](const auto& each) {
      if (each.second->gone()) messages.push_back({each.first, "bye"});
      return each.second->gone();
    });
    return messages;
  }

  static constexpr const char* kFull = "16 pages are open already; close one and try again";

  std::string token_;
  asio::io_context context_{1};
  std::vector<std::unique_ptr<tcp::acceptor>> acceptors_;
  int port_ = 0;
  std::shared_ptr<const std::string> page_;
  std::string policy_;
  std::deque<std::shared_ptr<HttpConnection>> requests_;  // in the order in which they came
  std::size_t downloads_ = 0;
  bool held_ = false;
  std::map<std::uint64_t, std::shared_ptr<Client>> clients_;
  std::uint64_t next_id_ = 1;
};

PageServer::PageServer(const std::string& token, int port)
    : impl_(std::make_unique<Impl>(token, port)) {
  if (impl_->port_ <= 0)
    throw Error(ErrorKind::kIo, {"cannot serve the page", "port " + std::to_string(port),
                                 "it is in use, or not allowed", "give another --port, or none"});
}

PageServer::~PageServer() = default;

int PageServer::port() const { return impl_->port_; }

void PageServer::set_page(std::string html, std::string policy) {
  impl_->page_ = std::make_shared<const std::string>(std::move(html));
  impl_->policy_ = std::move(policy);
}

std::vector<ViewMessage> PageServer::wait(int milliseconds) { return impl_->wait(milliseconds); }

void PageServer::hold(bool on) { impl_->held_ = on; }

bool PageServer::wants_frame() const {
  return std::ranges::any_of(impl_->clients_,
                             [](const auto& each) { return each.second->wants_frame(); });
}

void PageServer::show(std::string frame) {
  const auto shared = std::make_shared<const std::string>(std::move(frame));
  for (auto& [id, client] : impl_->clients_)
    if (client->wants_frame()) client->show(shared);
}

std::vector<std::uint64_t> PageServer::take_newcomers() {
  std::vector<std::uint64_t> newcomers;
  for (auto& [id, client] : impl_->clients_)
    if (client->take_newcomer()) newcomers.push_back(id);
  return newcomers;
}

void PageServer::answer(std::uint64_t to, std::string text) {
  const auto client = impl_->clients_.find(to);
  if (client != impl_->clients_.end()) client->second->answer(std::move(text));
}

}  // namespace sim
