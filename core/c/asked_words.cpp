#include "core/c/asked_words.h"

#include "core/base/text.h"
#include "core/c/handles.h"

namespace sim::c {

AskedWords::AskedWords(const char* const* texts) {
  for (; texts && *texts; ++texts) {
    const std::string text = *texts;
    const std::size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos)
      refuse("bad word", "asked '" + text + "'", "it is not NAME=VALUE", "write it like budget=1%");
    words_.emplace(text.substr(0, equals), text.substr(equals + 1));
  }
}

std::vector<std::string> AskedWords::all(const std::string& name) {
  std::vector<std::string> values;
  const auto [first, last] = words_.equal_range(name);
  for (auto word = first; word != last; ++word) values.push_back(word->second);
  words_.erase(first, last);
  return values;
}

std::string AskedWords::text(const std::string& name) {
  const std::vector<std::string> values = all(name);
  if (values.size() > 1)
    refuse("given twice", name, "only one of them can hold", "keep one of them");
  return values.empty() ? "" : values.front();
}

std::optional<double> AskedWords::number(const std::string& name) {
  const std::string value = text(name);
  if (value.empty()) return {};
  const std::optional<double> number = parse_number(value);
  if (!number || *number < 0)
    refuse("bad value", name + " '" + value + "'", "it is not a number of at least 0",
           "write it like 0.5");
  return number;
}

bool AskedWords::flag(const std::string& name, bool usual) {
  const std::string value = text(name);
  if (value.empty()) return usual;
  if (value != "0" && value != "1")
    refuse("bad value", name + " '" + value + "'", "it is 0 or 1",
           std::string(usual ? "1" : "0") + " is usual");
  return value == "1";
}

std::vector<std::string> AskedWords::list(const std::string& name) {
  std::vector<std::string> values;
  for (std::string rest = text(name); !rest.empty();) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    values.push_back(rest.substr(0, comma));
    rest.erase(0, comma + 1);
  }
  return values;
}

std::map<std::string, std::string> AskedWords::rest() {
  std::map<std::string, std::string> values;
  while (!words_.empty()) {
    const std::string name = words_.begin()->first;
    values[name] = text(name);
  }
  return values;
}

void AskedWords::finish(const std::string& study) const {
  if (words_.empty()) return;
  refuse("unknown word", words_.begin()->first, "study '" + study + "' does not take it",
         "see sim " + study + " --help");
}

}  // namespace sim::c
