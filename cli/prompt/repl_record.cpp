// Commands that record quantities during runs, and plot them.
#include "cli/prompt/repl_record.h"

#include <algorithm>
#include <cctype>

#include "cli/prompt/repl_actions.h"
#include "cli/terminal/signals.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/output/output.h"
#include "core/output/svg.h"

namespace sim::cli {

void Records::start(Record record) {
  remove(record.series.name);
  records_.push_back(std::move(record));
}

bool Records::remove(const std::string& name) {
  return std::erase_if(records_, [&](const Record& each) { return each.series.name == name; }) > 0;
}

const Records::Record* Records::find(const std::string& name) const {
  const auto found =
      std::ranges::find_if(records_, [&](const Record& each) { return each.series.name == name; });
  return found == records_.end() ? nullptr : &*found;
}

void Records::end(const std::string& name) {
  for (Record& each : records_)
    if (each.series.name == name) each.quantity = {};
}

void Records::take(const std::string& name, Prompt& lua, double t) {
  const auto found =
      std::ranges::find_if(records_, [&](const Record& each) { return each.series.name == name; });
  if (found == records_.end() || !found->quantity.reference) return;
  const Data value = lua.call(found->quantity);
  double number = 0;
  if (const auto* whole = std::get_if<std::int64_t>(&value.value))
    number = static_cast<double>(*whole);
  else if (const auto* real = std::get_if<double>(&value.value))
    number = *real;
  else
    throw Error(ErrorKind::kUsage,
                {"cannot record '" + name + "'", "", "expected a number, got " + lua_text(value),
                 "as in: .record sag -position(12)[2] every 10"});
  auto& points = found->series.points;
  while (!points.empty() && points.back().first >= t) points.pop_back();
  points.emplace_back(t, number);
}

namespace actions {
namespace {

struct Words {
  std::string name, code;
  std::int64_t every = 1;
};

std::string stripped(std::string text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  text.erase(0, std::min(text.find_first_not_of(" \t"), text.size()));
  return text;
}

// "NAME EXPR every N"; missing values stay empty.
Words split(const std::string& text, const Call& call) {
  Words words;
  const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
  words.name = text.substr(0, end);
  words.code = stripped(text.substr(end));
  const std::size_t every = words.code.rfind(" every ");
  if (every == std::string::npos) return words;
  const auto number = parse_integer(stripped(words.code.substr(every + 7)));
  if (!number || *number < 1) call.wrong("expected a number of steps from 1 on after 'every'");
  words.every = *number;
  words.code = stripped(words.code.substr(0, every));
  return words;
}

const Records::Record& record_named(const Call& call, const std::string& name) {
  const Records& records = call.session.records;
  if (const Records::Record* record = records.find(name)) return *record;
  std::vector<std::string> names;
  for (const Records::Record& each : records.all()) names.push_back(each.series.name);
  throw Error(ErrorKind::kUsage,
              {"no record '" + name + "'", "", "nothing of that name is recorded",
               names.empty() ? ".record NAME EXPR starts one" : suggestion(name, names)});
}

Answer list_of(const Records& records) {
  std::vector<std::vector<std::string>> rows;
  std::vector<Data> list;
  for (const Records::Record& each : records.all()) {
    const auto count = static_cast<std::int64_t>(each.series.points.size());
    rows.push_back({each.series.name, each.code, "every " + counted(each.every, "step"),
                    counted(count, "value")});
    list.emplace_back(std::vector<std::pair<Data, Data>>{
        {"name", each.series.name}, {"every", each.every}, {"values", count}});
  }
  return words(rows.empty() ? "nothing is recorded\n" : aligned(rows, ""), list);
}

Answer values_of(const Records::Record& record) {
  std::vector<Data> list;
  for (const auto& [t, value] : record.series.points)
    list.emplace_back(std::vector<std::pair<Data, Data>>{{"t", t}, {"value", value}});
  return {list};
}

// A record that fails, as in another scene without that particle, ends; the run continues.
void take_or_end(Session& session, const std::string& name) {
  try {
    session.records.take(name, session.lua(), session.live().system().t());
  } catch (const Error& error) {
    SessionSignals::check();
    session.records.end(name);
    put(session.console().err,
        "sim: warning: record '" + name + "' ended: " + error.text().why + "\n");
  }
}

// Runs sample the recorded quantities now.
void look_at_all(Session& session) {
  session.live().looks.clear();
  for (const Records::Record& each : session.records.all())
    session.live().looks.push_back(
        {each.every, [&session, name = each.series.name] { take_or_end(session, name); }});
}

}  // namespace

Answer record(Call& call) {
  call.take(0, 3);
  Session& session = call.session;
  if (call.count() == 0) return list_of(session.records);
  Words words =
      call.spoken ? split(call.text(0, "a name"), call) : Words{call.text(0, "a name"), "", 1};
  DataFunction quantity;
  if (!call.spoken && call.count() > 1) {
    if (call.count() > 2) words.every = call.integer(2, 1, "a number of steps");
    if (const auto* function = std::get_if<DataFunction>(&call[1].value)) {
      quantity = *function;
      words.code = "a function";
    } else {
      words.code = call.text(1, "a Lua expression or a function");
    }
  }
  if (words.code.empty()) return values_of(record_named(call, words.name));
  if (words.code == "off") {
    record_named(call, words.name);
    session.records.remove(words.name);
    look_at_all(session);
    return {};
  }
  if (!quantity.reference)
    quantity = session.lua().compile(words.code, session.where(), session.line());
  session.records.start({{words.name, {}}, words.code, words.every, quantity});
  try {
    session.records.take(words.name, session.lua(), session.live().system().t());
  } catch (...) {
    session.records.remove(words.name);
    look_at_all(session);
    throw;
  }
  look_at_all(session);
  return {};
}

Answer plot(Call& call) {
  call.take(1, 2);
  const TimeSeries& series = record_named(call, call.text(0, "the name of a record")).series;
  if (call.count() == 1) return words(text_plot(series));
  const std::string file = call.text(1, "a file");
  if (!file.ends_with(".svg")) call.wrong("a plot goes to a file that ends in .svg, got " + file);
  call.session.check_output(".plot", file);
  Output output({file}, call.session.console().out);
  output.buffer() += svg(TimeChart{.title = series.name,
                                   .y_name = "",
                                   .curves = {{.name = series.name, .points = series.points}},
                                   .from_zero = false});
  output.commit();
  return {};
}

}  // namespace actions
}  // namespace sim::cli
