#include "core/session/recording.h"

#include <algorithm>
#include <charconv>
#include <cstdio>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/base/utf8.h"

namespace sim {
namespace {

constexpr std::int64_t kMostSteps = 9'000'000'000'000'000;
constexpr std::string_view kFirstLine = "# a recording of sim";
constexpr const char* kHeaderWords[] = {"scene", "set",        "off", "without",
                                        "seed",  "integrator", "dt"};

template <class Number>
std::optional<Number> whole_number(std::string_view text, int base = 10) {
  Number value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (failed != std::errc() || end != text.data() + text.size() || text.empty()) return {};
  return value;
}

std::string_view without_spaces(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r'))
    text.remove_suffix(1);
  return text;
}

// Removes the first word from the text and returns it.
std::string_view take_word(std::string_view& text) {
  const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
  const std::string_view word = text.substr(0, end);
  text = without_spaces(text.substr(end));
  return word;
}

class RecordingReader {
 public:
  RecordingReader(std::string_view text, const std::string& file) : text_(text), file_(&file) {}

  Recording read() {
    while (!text_.empty()) {
      const std::size_t end = text_.find('\n');
      if (end == std::string_view::npos) break;  // cut off
      ++recording_.lines;
      take(without_spaces(text_.substr(0, end)));
      text_.remove_prefix(end + 1);
    }
    recording_.whole = !cursors_.empty();
    for (auto& [name, cursor] : cursors_) {
      discard(cursor, cursor.now);
      recording_.whole = recording_.whole && cursor.system.hash.has_value();
      cursor.system.end = cursor.now;
      recording_.systems[name] = std::move(cursor.system);
    }
    return std::move(recording_);
  }

 private:
  struct Cursor {
    RecordedSystem system;
    std::int64_t now = 0;
  };

  [[noreturn]] void wrong(const std::string& what, const std::string& why,
                          const std::string& remedy) const {
    throw Error(ErrorKind::kScene,
                {what, *file_ + ":" + std::to_string(recording_.lines), why, remedy});
  }

  static void discard(Cursor& cursor, std::int64_t after) {
    auto& actions = cursor.system.actions;
    while (!actions.empty() && actions.back().step > after) actions.pop_back();
  }

  void take(std::string_view line) {
    if (line.empty() || line.front() == '#') return;
    if (line.front() == '+') return take_step(line.substr(1));
    const std::string word(take_word(line));
    if (std::ranges::find(kHeaderWords, word) == std::end(kHeaderWords))
      wrong("bad line",
            "'" + std::string(utf8_head(word, 40)) + "' is neither +STEPS nor a word of the header",
            "write +STEPS ACTION");
    if (!cursors_.empty())
      wrong("bad line", "'" + word + "' belongs above the first +STEPS", "put it there");
    if (line.empty()) wrong("bad line", "'" + word + "' has no value", "give one, or remove it");
    recording_.header.emplace_back(word, line);
  }

  void take_step(std::string_view line) {
    const std::string_view count = take_word(line);
    const auto steps = whole_number<std::int64_t>(count);
    if (!steps || *steps < 0 || *steps > kMostSteps)
      wrong("bad line", "'+" + std::string(utf8_head(count, 40)) + "' is no number of steps",
            "write +STEPS ACTION");
    std::string name;
    if (const std::size_t colon = line.find(':');
        colon != std::string_view::npos && line.find_first_of(" \t") > colon) {
      name = line.substr(0, colon);
      line = without_spaces(line.substr(colon + 1));
    }
    Cursor& cursor = cursors_[name];
    if (cursor.system.hash)
      wrong("bad line", "the recording has ended before it", "remove what comes after the end");
    if (*steps > kMostSteps - cursor.now) wrong("bad line", "too many steps", "write fewer");
    cursor.now += *steps;
    std::string_view rest = line;
    const std::string_view word = take_word(rest);
    if (word == "end") return take_end(cursor, rest);
    if (word == "back") return take_back(cursor, rest);
    if (word == "undo") return take_undo(cursor, rest);
    take_action(cursor, line);
  }

  void take_end(Cursor& cursor, std::string_view rest) const {
    cursor.system.hash = whole_number<std::uint64_t>(rest, 16);
    if (!cursor.system.hash || rest.size() != 16)
      wrong("bad line", "the end has no hash of 16 digits", "remove the line to replay without it");
  }

  // Later actions are kept until another action is made here.
  void take_back(Cursor& cursor, std::string_view rest) const {
    const auto steps = whole_number<std::int64_t>(rest);
    if (!steps || *steps < 0 || *steps > cursor.now)
      wrong("bad line",
            "it goes back '" + std::string(utf8_head(rest, 40)) + "' steps of " +
                std::to_string(cursor.now),
            "write +STEPS back N");
    cursor.now -= *steps;
  }

  void take_undo(Cursor& cursor, std::string_view rest) const {
    auto& actions = cursor.system.actions;
    discard(cursor, cursor.now);
    const auto count = whole_number<std::uint64_t>(rest);
    if (!count || *count == 0 || *count > actions.size())
      wrong("bad line",
            "it takes back '" + std::string(utf8_head(rest, 40)) + "' actions of " +
                std::to_string(actions.size()),
            "write +STEPS undo N");
    actions.resize(actions.size() - *count + 1);
    cursor.now = actions.back().step;
    actions.pop_back();
  }

  void take_action(Cursor& cursor, std::string_view line) const {
    Action action;
    try {
      action = parse_action(line);
    } catch (const Error& error) {
      ErrorText text = error.text();
      wrong("bad line", text.what + " " + text.where + ": " + text.why, text.remedy);
    }
    auto& actions = cursor.system.actions;
    if (action.what == Action::What::kReset) {
      // The present settings hold from the start on.
      discard(cursor, cursor.now);
      std::erase_if(actions,
                    [](const RecordedAction& each) { return !each.action.changes_settings(); });
      for (RecordedAction& each : actions) each.step = 0;
      cursor.now = 0;
    }
    discard(cursor, cursor.now);
    actions.push_back({cursor.now, std::move(action), recording_.lines});
  }

  std::string_view text_;
  const std::string* file_;
  Recording recording_;
  std::map<std::string, Cursor> cursors_;
};

}  // namespace

Recording parse_recording(std::string_view text, const std::string& file) {
  return RecordingReader(text, file).read();
}

// --- Writing ----------------------------------------------------------------------------------

RecordingWriter::RecordingWriter(Sink sink,
                                 const std::vector<std::pair<std::string, std::string>>& header,
                                 bool world)
    : sink_(std::move(sink)), world_(world) {
  std::string lines = std::string(kFirstLine) + ": sim --replay FILE\n";
  for (const auto& [word, value] : header) lines += word + ' ' + value + '\n';
  sink_(lines);
}

void RecordingWriter::line(const std::string& system, std::int64_t step, const std::string& words) {
  std::int64_t& at = at_[system];
  sink_("+" + std::to_string(step - at) + ' ' + (world_ ? system + ": " : "") + words + '\n');
  at = step;
}

void RecordingWriter::action(const std::string& system, std::int64_t step, const Action& action) {
  line(system, step, to_text(action));
}

void RecordingWriter::reset(const std::string& system, std::int64_t step) {
  line(system, step, "reset");
  at_[system] = 0;
}

void RecordingWriter::back(const std::string& system, std::int64_t from, std::int64_t to) {
  line(system, from, "back " + std::to_string(from - to));
  at_[system] = to;
}

void RecordingWriter::undo(const std::string& system, std::size_t actions, std::int64_t from,
                           std::int64_t to) {
  line(system, from, "undo " + std::to_string(actions));
  at_[system] = to;
}

void RecordingWriter::end(const std::string& system, std::int64_t step, std::uint64_t hash) {
  char digits[17];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(hash));
  line(system, step, std::string("end ") + digits);
}

}  // namespace sim
