// The functions of the module that the worker of a page calls. Texts go in and out as UTF-8; one
// that is returned is valid until the next call.
#include <emscripten/emscripten.h>

#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "cli/run/environment.h"
#include "cli/terminal/console.h"
#include "cli/verbs/luacats.h"
#include "cli/verbs/stability.h"
#include "cli/verbs/tradeoff.h"
#include "cli/view/page_session.h"
#include "core/base/error.h"
#include "core/output/format.h"
#include "core/report/replays.h"

namespace sim::cli {
namespace {

struct Page {
  Environment environment = find_environment({});
  Registry registry = open_registry(environment, {});
  PageSession session{environment, registry};
  std::string text = {};

  const char* answer(std::string words) {
    text = std::move(words);
    return text.c_str();
  }
};

// A file of the module's own file system, with the header of a recording: lines as "set n=3".
SceneRequest request_of(const char* file, const char* header) {
  sim::report::RecordingHeader words;
  std::istringstream lines{std::string(header)};
  for (std::string line; std::getline(lines, line);)
    if (const std::size_t blank = line.find(' '); blank != std::string::npos)
      words.emplace_back(line.substr(0, blank), line.substr(blank + 1));
  sim::report::NamedScene named;
  named.scene = file;
  complete(named, words, "the page");
  return with_scene({}, named);
}

}  // namespace
}  // namespace sim::cli

using namespace sim::cli;

extern "C" {

EMSCRIPTEN_KEEPALIVE Page* sim_page() { return new Page; }

// The reason why the scene cannot be shown, or "".
EMSCRIPTEN_KEEPALIVE const char* sim_open(Page* page, const char* file, const char* header) {
  try {
    page->session.open(request_of(file, header));
    return page->answer("");
  } catch (...) {
    std::ostringstream words;
    report_exception(words);
    return page->answer(words.str());
  }
}

EMSCRIPTEN_KEEPALIVE int sim_number(Page* page) { return page->session.number(); }

EMSCRIPTEN_KEEPALIVE const char* sim_html(Page* page, const char* nonce) {
  return page->answer(page->session.html(nonce));
}

EMSCRIPTEN_KEEPALIVE const char* sim_say(Page* page, const char* words) {
  return page->answer(page->session.take(words));
}

EMSCRIPTEN_KEEPALIVE int sim_run(Page* page, double seconds) { return page->session.run(seconds); }

// A frame, whose length sim_size() tells.
EMSCRIPTEN_KEEPALIVE const char* sim_frame(Page* page) {
  return page->answer(page->session.frame());
}
EMSCRIPTEN_KEEPALIVE int sim_size(Page* page) { return static_cast<int>(page->text.size()); }

EMSCRIPTEN_KEEPALIVE const char* sim_past(Page* page) { return page->answer(page->session.past()); }

EMSCRIPTEN_KEEPALIVE const char* sim_recording(Page* page) {
  return page->answer(page->session.recording());
}

// The words of `sim stability` or `sim tradeoff` about a scene; its plot goes to the file `svg`.
EMSCRIPTEN_KEEPALIVE const char* sim_study(Page* page, const char* name, const char* file,
                                           const char* header, const char* svg) {
  std::ostringstream out;
  Console console{out, out};
  const auto study = [&](auto request, auto verb) {
    request.scene = request_of(file, header);
    // A plot is of one system.
    if (load(request.scene, page->environment, page->registry).systems.size() == 1)
      request.svg = svg;
    verb(request, page->environment, page->registry, console);
  };
  try {
    if (std::string_view(name) == "stability")
      study(StabilityRequest{}, stability);
    else
      study(TradeoffRequest{}, tradeoff);
  } catch (...) {
    report_exception(out);
  }
  return page->answer(out.str());
}

// The scene with its parameters as they are, in the words of sim_open().
EMSCRIPTEN_KEEPALIVE const char* sim_header(Page* page) {
  std::string lines;
  for (const auto& [word, value] :
       sim::report::recording_header(named_scene(page->session.request())))
    lines += word + ' ' + value + '\n';
  return page->answer(lines);
}

// A search for a method and a step that keep an error: its number, or 0 if none is wanted; the
// error; the search itself; and what to do with its findings.
EMSCRIPTEN_KEEPALIVE int sim_wanted(Page* page) { return page->session.wanted(); }

EMSCRIPTEN_KEEPALIVE const char* sim_asked(Page* page) {
  return page->answer(page->session.asked());
}

EMSCRIPTEN_KEEPALIVE const char* sim_search(Page* page, const char* file, const char* header,
                                            const char* error) {
  const FoundChoice found =
      choose_for_view(request_of(file, header), error, page->environment, page->registry,
                      [](std::string_view, double) { return true; });
  return page->answer(
      sim::JsonObject().text("commands", found.commands).text("words", found.words).str());
}

EMSCRIPTEN_KEEPALIVE void sim_choose(Page* page, int number, const char* commands,
                                     const char* words) {
  page->session.choose(number, {commands, words});
}

// The names of the scene language, as `sim list --luacats` has them.
EMSCRIPTEN_KEEPALIVE const char* sim_names(Page* page) {
  return page->answer(luacats(page->environment, page->registry));
}

}  // extern "C"
