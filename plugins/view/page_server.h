// A server for one page and its WebSocket, at the loopback addresses of this machine: the whole
// server side of `sim view`, and no more of HTTP than a browser needs for it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/output/view.h"

namespace sim {

// It answers GET /TOKEN/ with the page and upgrades GET /TOKEN/socket to a WebSocket of version 13,
// if Host is a name of this machine and Origin is the page's own. Requests have no body, a
// connection has one request, client frames are masked text. Everything else is closed. Input from
// outside never throws, and takes bounded memory.
class PageServer {
 public:
  // Port 0 is any that is free. Throws Error{kIo} when nothing can listen there.
  PageServer(const std::string& token, int port);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  int port() const;
  // For requests from now on; the policy (CSP) lets the page connect to this server, too.
  void set_page(std::string html, std::string policy);

  // Serves for at most so many milliseconds, until something is done. At most one message of each
  // client is returned; nothing more is read of one that has some left.
  std::vector<ViewMessage> wait(int milliseconds);
  void hold(bool on);  // none are returned

  // A picture goes to the clients that are ready for another; a client that is slow misses some.
  bool wants_frame() const;
  void show(std::string frame);
  std::vector<std::uint64_t> take_newcomers();  // clients that ask for the past
  void answer(std::uint64_t to, std::string text);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sim
