// What somebody looks at while a scene runs: a page that is served, and words that come back from
// it. Each kind is a plugin, opened when it is asked for.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sim {

struct ViewTask {
  std::string page;   // HTML; @SOCKET@ in it becomes the address its WebSocket has
  std::string token;  // what an address must hold to be answered: letters and digits
  int port = 0;       // 0: one that is free
};

// What somebody said, and who: the number of a connection.
struct ViewMessage {
  std::uint64_t from = 0;
  std::string text;
};

// Knows no scene. Nothing blocks but wait(), and nothing that comes from outside can throw.
class View {
 public:
  static constexpr std::size_t kMostText = 4096;  // bytes of a message; longer ones end its sender

  virtual ~View() = default;

  virtual std::string address() const = 0;  // to be opened by a person

  // Serves what is due, for at most so many milliseconds; returns what came in.
  virtual std::vector<ViewMessage> wait(int milliseconds) = 0;

  // The connections that are open. One is told of a frame only when its last one has left: until
  // then the newest waits.
  virtual int watchers() const = 0;
  virtual bool wants_frame() const = 0;
  virtual void show(const std::string& frame) = 0;                     // bytes, to all
  virtual void answer(std::uint64_t to, const std::string& text) = 0;  // text, to one
  virtual void renew(const std::string& page) = 0;                     // for who asks from now on
};

}  // namespace sim
