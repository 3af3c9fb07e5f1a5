#include "cli/prompt/repl.h"

#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <sstream>

#include "cli/prompt/repl_help.h"
#include "cli/prompt/repl_terminal.h"
#include "cli/terminal/signals.h"
#include "core/report/recording_file.h"
#include "core/report/replays.h"

namespace sim::cli {
namespace {

// Takes each line in turn; false once the session has ended.
bool take_lines(Session& session, const std::string& text, const std::string& where) {
  std::istringstream lines(text);
  int number = 0;
  bool complete = true;
  for (std::string line; !session.exit_code && std::getline(lines, line);)
    complete = session.take(line, where, ++number);
  return complete;
}

// $SIM_INIT, or init.lua in $XDG_CONFIG_HOME/sim (or else ~/.config/sim) where there is one.
std::string init_file() {
  const auto variable = [](const char* name) -> std::string {
    const char* value = std::getenv(name);
    return value ? value : "";
  };
  if (const std::string given = variable("SIM_INIT"); !given.empty()) return given;
  std::filesystem::path folder = variable("XDG_CONFIG_HOME");
  if (const std::string home = variable("HOME"); folder.empty() && !home.empty())
    folder = std::filesystem::path(home) / ".config";
  const std::filesystem::path file = folder / "sim" / "init.lua";
  std::error_code failed;
  return !folder.empty() && std::filesystem::is_regular_file(file, failed) ? file.string() : "";
}

// An error in it does not prevent the session.
void read_init(Session& session, Console& console, const std::string& file) {
  if (file.empty()) return;
  try {
    session.read_init(file);
  } catch (const Error&) {
    session.forget_unfinished();
    report_exception(console.err);
  }
}

int interact(Session& session, const ReplCommandLine& asked, Console& console) {
  LineEditor editor(history_file(), [&](const std::string& line, std::size_t begin) {
    return complete(session, line, begin);
  });
  session.tell(session.banner());
  if (asked.init.empty()) read_init(session, console, init_file());
  std::string entry;  // lines that belong together, for the history
  while (!session.exit_code) {
    bool running = false, over = false;
    try {
      SessionSignals::forget_interrupt();
      SessionSignals::check();
      const auto text = editor.read(session.prompt());
      if (!text) {
        over = true;  // whether or not anybody is there to read
        session.say("\n");
        break;
      }
      entry += entry.empty() ? *text : "\n" + *text;
      running = true;
      const bool complete = take_lines(session, *text, "prompt");
      if (!complete) continue;
    } catch (const Interrupted&) {
      if (SessionSignals::caught() != SIGINT) return 128 + SessionSignals::caught();
      session.forget_unfinished();
      if (running) {
        put_control(console.err, "\r\x1b[K");
        session.tell("stopped\n");
      }
      session.tell_position();
    } catch (const ClosedPipe&) {
      return report_exception(console.err);
    } catch (...) {
      const int code = report_exception(console.err);
      if (over) return code;
    }
    editor.remember(entry);
    entry.clear();
  }
  return session.exit_code.value_or(0);
}

// The record that a session writes as long as it lives.
class SessionRecord {
 public:
  SessionRecord(Session& session, const SceneRequest& scene, const std::string& file,
                std::ostream& errors)
      : session_(session) {
    if (file.empty()) return;
    session.check_output("--record", file);
    session.files().writes("--record", file);
    file_.emplace(file, [&errors](const std::string& why) { print_error(errors, why); });
    writer_.emplace([this](std::string_view lines) { file_->append(lines); },
                    report::recording_header(named_scene(scene)),
                    session.live().scene().spec.world);
    session.live().record(&*writer_);
  }
  ~SessionRecord() { session_.live().end_record(); }
  SessionRecord(const SessionRecord&) = delete;
  SessionRecord& operator=(const SessionRecord&) = delete;

  void begin() {
    if (file_) file_->begin();
  }
  // The exit code of a session that ended with `code`.
  int end(int code) {
    session_.live().end_record();
    return code == 0 && file_ ? file_->finish() : code;
  }

 private:
  Session& session_;
  std::optional<report::RecordingFile> file_;
  std::optional<RecordingWriter> writer_;
};

void read_input(Session& session) {
  int number = 0;
  for (std::string line; !session.exit_code && std::getline(std::cin, line);)
    session.take(line, "stdin", ++number);
  SessionSignals::check();
  if (!session.exit_code) session.end();
}

}  // namespace

int repl(const ReplCommandLine& line, const Environment& environment, Registry& registry,
         Console& console) {
  const SessionSignals signals;
  SessionRequest request = line.session;
  request.interactive = line.sources.empty() && ::isatty(STDIN_FILENO) == 1;
  try {
    Session session(request, environment, registry, console);
    session.mode = line.mode;
    if (!line.resume.empty()) session.live().resume(line.resume);
    for (const auto& source : line.sources)
      if (source.file) session.files().reads("the script", source.text);
    if (!line.init.empty()) session.files().reads("the script", line.init);
    SessionRecord record(session, request.scene, line.record, console.err);
    if (!line.init.empty() && line.init != "none") session.read_init(line.init);
    record.begin();
    if (request.interactive) return record.end(interact(session, line, console));
    for (const auto& source : line.sources) {
      if (session.exit_code) break;
      if (source.file) {
        session.read(source.text);
      } else {
        take_lines(session, source.text, "-e");
        session.end();
      }
    }
    if (line.sources.empty()) read_input(session);
    return record.end(session.exit_code.value_or(0));
  } catch (const Interrupted&) {
    return 128 + SessionSignals::caught();
  }
}

}  // namespace sim::cli
