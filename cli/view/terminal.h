// The same in a terminal: half blocks for the picture, its reports for the mouse.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "cli/terminal/cells.h"
#include "cli/view/live.h"
#include "core/output/front.h"

namespace sim::cli {

// The terminal as it is needed, and as it was again on every way out: when this ends, and on
// signals that end the program.
class Takeover {
 public:
  Takeover();  // throws Error{kIo} where standard input or output is no terminal
  ~Takeover();
  Takeover(const Takeover&) = delete;
  Takeover& operator=(const Takeover&) = delete;
};

// The events of a terminal: keys, and the position of the mouse, in cells from 0.
struct TerminalEvent {
  enum class What { kKey, kPress, kMove, kRelease, kWheel } what = What::kKey;
  std::string key;  // "q", "Left", "Space", ...
  int x = 0, y = 0, button = 0;
  bool shift = false, control = false;
};

// Takes whole events from the text and leaves what may go on. Never fails.
std::vector<TerminalEvent> take_events(std::string& text);

class TerminalFront {
 public:
  explicit TerminalFront(Live& live);

  void take(const TerminalEvent& event);
  bool closed() const { return front_.closed(); }
  std::string picture();  // the output due now

 private:
  std::string status() const;

  Live& live_;
  Front front_;
  ViewState state_;
  CellSize size_;
  Cells cells_;
  std::unique_ptr<Raster> raster_;
  bool help_ = false;
  std::string said_;
};

}  // namespace sim::cli
