// A page on this machine alone, through libwebsockets: one address with a token that nobody can
// guess, for browsers that were sent there. Other pages, hosts and addresses are refused.
#include <libwebsockets.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <map>
#include <memory>

#include "core/base/error.h"
#include "core/output/format.h"
#include "core/output/page/live_page.h"
#include "core/plugin/plugin.h"

namespace {

constexpr std::size_t kChunk = 65536;  // bytes of the page at once
constexpr int kInFlight = 2;           // frames that a page has not yet drawn
constexpr std::size_t kMostClients = 16, kMostAnswers = 64;

struct Client {
  std::uint64_t id = 0;
  std::string text;  // of a message that is not yet whole
  std::deque<std::string> answers;
  std::string frame;
  bool has_frame = false, asks_past = false;
  int in_flight = 0;
};

class Web final : public sim::View {
 public:
  explicit Web(const sim::ViewTask& task);
  ~Web() override {
    if (context_) lws_context_destroy(context_);
  }

  std::string address() const override {
    return "http://127.0.0.1:" + std::to_string(port_) + "/" + task_.token + "/";
  }
  std::vector<sim::ViewMessage> wait(int milliseconds) override;
  bool wants_frame() const override {
    return std::ranges::any_of(clients_, [](const auto& each) { return takes_frame(each.second); });
  }
  void show(const sim::Moment& moment, const sim::ViewState& state) override;
  void refuse(std::uint64_t to, const std::string& why) override;
  void renew(const sim::ViewScene& scene) override;

 private:
  struct Sending {
    std::shared_ptr<const std::string> html;
    std::size_t sent = 0;
  };
  static bool takes_frame(const Client& client) {
    return !client.has_frame && client.in_flight < kInFlight;
  }
  static int called(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t size);
  int listen(const char* at, int port);
  int http(lws* wsi, const std::string& path);
  int more_of_page(lws* wsi);
  bool admits(lws* wsi) const;
  int receive(lws* wsi, const char* bytes, std::size_t size);
  int write(lws* wsi);
  static void answer(lws* wsi, Client& client, const std::string& text);

  static std::string header(lws* wsi, lws_token_indexes token) {
    char text[256];
    return lws_hdr_copy(wsi, text, sizeof text, token) > 0 ? text : "";
  }

  sim::ViewTask task_;
  lws_protocols protocols_[2]{};
  lws_context* context_ = nullptr;
  int port_ = 0;
  std::map<lws*, Client> clients_;
  std::unique_ptr<sim::LivePage> page_;
  std::shared_ptr<const std::string> html_;
  std::map<lws*, Sending> pages_;  // that are being sent
  std::vector<sim::ViewMessage> inbox_;
  std::uint64_t next_id_ = 1;
};

Web::Web(const sim::ViewTask& task) : task_(task) {
  renew(task.scene);
  lws_set_log_level(0, nullptr);
  protocols_[0].name = "sim";
  protocols_[0].callback = called;
  protocols_[0].rx_buffer_size = kMostText;
  lws_context_creation_info info{};
  info.protocols = protocols_;
  info.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS | LWS_SERVER_OPTION_VALIDATE_UTF8;
  info.user = this;
  info.gid = info.uid = static_cast<unsigned>(-1);
  context_ = lws_create_context(&info);
  port_ = listen("127.0.0.1", task_.port);
  if (port_ > 0) listen("::1", port_);  // where there is one, and the port is free
  if (port_ <= 0)
    throw sim::Error(sim::ErrorKind::kIo,
                     {"cannot serve the page", "port " + std::to_string(task_.port),
                      "it is in use, or not allowed", "give another --port, or none"});
}

// The port it listens at, or 0.
int Web::listen(const char* at, int port) {
  lws_context_creation_info info{};
  info.vhost_name = info.iface = at;
  info.port = port;
  info.protocols = protocols_;
  info.options = LWS_SERVER_OPTION_DISABLE_IPV6;
  if (std::strchr(at, ':'))
    info.options = LWS_SERVER_OPTION_IPV6_V6ONLY_MODIFY | LWS_SERVER_OPTION_IPV6_V6ONLY_VALUE;
  lws_vhost* const host = context_ ? lws_create_vhost(context_, &info) : nullptr;
  return host ? std::max(0, lws_get_vhost_listen_port(host)) : 0;
}

void Web::renew(const sim::ViewScene& scene) {
  page_ = std::make_unique<sim::LivePage>(scene, task_.pause_hidden);
  html_ = std::make_shared<const std::string>(page_->html("/" + task_.token + "/socket"));
}

int Web::called(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size) {
  lws_context* const context = wsi ? lws_get_context(wsi) : nullptr;
  auto* const web = context ? static_cast<Web*>(lws_context_user(context)) : nullptr;
  if (!web) return 0;
  const char* const bytes = static_cast<const char*>(in);
  switch (reason) {
    case LWS_CALLBACK_HTTP:
      return web->http(wsi, bytes ? std::string(bytes) : "");
    case LWS_CALLBACK_HTTP_WRITEABLE:
      return web->more_of_page(wsi);
    case LWS_CALLBACK_CLOSED_HTTP:
      web->pages_.erase(wsi);
      return 0;
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
      return web->admits(wsi) && web->clients_.size() < kMostClients ? 0 : -1;
    case LWS_CALLBACK_ESTABLISHED:
      web->clients_[wsi].id = web->next_id_++;
      return 0;
    case LWS_CALLBACK_RECEIVE:
      return web->receive(wsi, bytes, size);
    case LWS_CALLBACK_SERVER_WRITEABLE:
      return web->write(wsi);
    case LWS_CALLBACK_CLOSED:
      if (const auto client = web->clients_.find(wsi); client != web->clients_.end()) {
        web->inbox_.push_back({client->second.id, "bye"});
        web->clients_.erase(client);
      }
      return 0;
    default:
      return 0;
  }
}

// A page of somebody else names its own host as Origin; a name that somebody else's server gave to
// this address stands in Host.
bool Web::admits(lws* wsi) const {
  const std::string host = header(wsi, WSI_TOKEN_HOST);
  const std::size_t end = host.find_last_not_of("0123456789");
  const std::string name =
      host.substr(0, end < host.size() && host[end] == ':' ? end : host.size());
  if (name != "127.0.0.1" && name != "localhost" && name != "[::1]") return false;
  const std::string path = header(wsi, WSI_TOKEN_GET_URI);
  if (!path.starts_with("/" + task_.token + "/")) return false;
  if (!path.ends_with("/socket")) return true;
  return header(wsi, WSI_TOKEN_ORIGIN) == "http://" + host;
}

int Web::http(lws* wsi, const std::string& path) {
  const bool page = path == "/" + task_.token + "/";
  if (!admits(wsi) || !page)
    return lws_return_http_status(wsi, HTTP_STATUS_FORBIDDEN, nullptr) != 0 ||
                   lws_http_transaction_completed(wsi)
               ? -1
               : 0;
  unsigned char head[LWS_PRE + 1024], *at = head + LWS_PRE, *const end = head + sizeof head;
  const auto add = [&](const char* name, const std::string& value) {
    return lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char*>(name),
                                       reinterpret_cast<const unsigned char*>(value.data()),
                                       static_cast<int>(value.size()), &at, end) == 0;
  };
  if (lws_add_http_common_headers(wsi, HTTP_STATUS_OK, "text/html; charset=utf-8", html_->size(),
                                  &at, end) != 0 ||
      !add("cache-control:", "no-store") || !add("x-frame-options:", "DENY") ||
      !add("referrer-policy:", "no-referrer") ||
      lws_finalize_write_http_header(wsi, head + LWS_PRE, &at, end) != 0)
    return -1;
  pages_[wsi] = {html_};
  lws_callback_on_writable(wsi);
  return 0;
}

int Web::more_of_page(lws* wsi) {
  const auto sent = pages_.find(wsi);
  if (sent == pages_.end()) return 0;
  const std::string& page = *sent->second.html;
  const std::size_t count = std::min(kChunk, page.size() - sent->second.sent);
  const bool last = sent->second.sent + count == page.size();
  std::vector<unsigned char> chunk(LWS_PRE + count);
  std::memcpy(chunk.data() + LWS_PRE, page.data() + sent->second.sent, count);
  if (lws_write(wsi, chunk.data() + LWS_PRE, count, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) <
      0)
    return -1;
  sent->second.sent += count;
  if (!last) {
    lws_callback_on_writable(wsi);
    return 0;
  }
  pages_.erase(sent);
  return lws_http_transaction_completed(wsi) ? -1 : 0;
}

int Web::receive(lws* wsi, const char* bytes, std::size_t size) {
  const auto found = clients_.find(wsi);
  if (found == clients_.end() || lws_frame_is_binary(wsi)) return -1;
  Client& client = found->second;
  if (client.text.size() + size > kMostText) return -1;
  client.text.append(bytes, size);
  if (!lws_is_final_fragment(wsi) || lws_remaining_packet_payload(wsi) > 0) return 0;
  const std::string text = std::exchange(client.text, {});
  if (text == "drawn")
    client.in_flight = std::max(0, client.in_flight - 1);
  else if (text == "hello")
    client.asks_past = true;
  else
    inbox_.push_back({client.id, text});
  return 0;
}

int Web::write(lws* wsi) {
  const auto found = clients_.find(wsi);
  if (found == clients_.end()) return -1;
  Client& client = found->second;
  const bool answers = !client.answers.empty();
  if (!answers && !client.has_frame) return 0;  // also called where nobody asked
  std::string text = std::string(LWS_PRE, '\0') + (answers ? client.answers.front() : client.frame);
  const std::size_t size = text.size() - LWS_PRE;
  if (lws_write(wsi, reinterpret_cast<unsigned char*>(text.data()) + LWS_PRE, size,
                answers ? LWS_WRITE_TEXT : LWS_WRITE_BINARY) < static_cast<int>(size))
    return -1;
  if (answers) {
    client.answers.pop_front();
  } else {
    client.has_frame = false;
    ++client.in_flight;
  }
  if (!client.answers.empty() || client.has_frame) lws_callback_on_writable(wsi);
  return 0;
}

std::vector<sim::ViewMessage> Web::wait(int milliseconds) {
  lws_sorted_usec_list_t alarm{};
  if (milliseconds > 0) {
    lws_sul_schedule(
        context_, 0, &alarm, [](lws_sorted_usec_list_t*) {},
        static_cast<lws_usec_t>(milliseconds) * 1000);
    lws_service(context_, 0);
    lws_sul_schedule(context_, 0, &alarm, nullptr, LWS_SET_TIMER_USEC_CANCEL);
  }
  // A large frame leaves in many calls: until nothing is left that can be done at once.
  for (int i = 0; i < 32; ++i) lws_service(context_, -1);
  return std::exchange(inbox_, {});
}

void Web::show(const sim::Moment& moment, const sim::ViewState& state) {
  const std::string frame = page_->frame(moment, state);
  for (auto& [wsi, client] : clients_) {
    if (std::exchange(client.asks_past, false))
      answer(wsi, client, sim::LivePage::past(state.past));
    if (!takes_frame(client)) continue;
    client.frame = frame;
    client.has_frame = true;
    lws_callback_on_writable(wsi);
  }
}

void Web::answer(lws* wsi, Client& client, const std::string& text) {
  if (client.answers.size() >= kMostAnswers) return;
  client.answers.push_back(text);
  lws_callback_on_writable(wsi);
}

void Web::refuse(std::uint64_t to, const std::string& why) {
  for (auto& [wsi, client] : clients_)
    if (client.id == to) answer(wsi, client, sim::JsonObject().text("error", why).str());
}

}  // namespace

SIM_PLUGIN(View, "web") {
  registrar.add(sim::Plugin<sim::View>{
      {.name = "web",
       .summary = "a page in the browser: see, pull, pin, switch, travel in time",
       .formula = "sim view SCENE"},
      [](const sim::Params&, const sim::ViewTask& task) { return std::make_unique<Web>(task); }});
}
