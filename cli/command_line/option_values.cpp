#include "cli/command_line/option_values.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <span>
#include <thread>

#include "cli/run/scene.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/base/units.h"
#include "core/lua/lua_keywords.h"

namespace sim::cli {

void usage_error(const std::string& what, const std::string& where, const std::string& why,
                 const std::string& remedy) {
  throw Error(ErrorKind::kUsage, {what, where, why, remedy});
}

namespace {

[[noreturn]] void bad_value(const std::string& option, const std::string& text,
                            const std::string& why, const std::string& remedy) {
  usage_error("bad value", option + " '" + text + "'", why, remedy);
}

double time_in(const std::string& option, const std::string& text) {
  const std::optional<double> value = seconds_of(text);
  if (!value) bad_value(option, text, "it is no time", "write it in s, or like 5ms, 200us or 2min");
  return *value;
}

}  // namespace

std::optional<double> seconds_of(const std::string& text) {
  struct Scale {
    const char* unit;
    const char* exponent;
    double factor;
  };
  constexpr Scale kScales[] = {
      {"us", "e-6", 1}, {"ms", "e-3", 1}, {"min", "", 60}, {"h", "", 3600}, {"s", "", 1}};
  for (const Scale& scale : kScales) {
    if (!text.ends_with(scale.unit)) continue;
    std::string digits = text.substr(0, text.size() - std::string_view(scale.unit).size());
    while (digits.ends_with(' ')) digits.pop_back();
    // 5ms has the bits of 0.005, which a product by 1e-3 need not have.
    const std::optional<double> value = parse_number(digits + scale.exponent);
    return value && std::isfinite(*value * scale.factor) ? std::optional(*value * scale.factor)
                                                         : std::nullopt;
  }
  return parse_number(text);
}

double positive_time(const std::string& option, const std::string& text) {
  const double value = time_in(option, text);
  if (!(value > 0)) bad_value(option, text, "it must be above 0", "write it like 0.005 or 5ms");
  return value;
}

double non_negative_time(const std::string& option, const std::string& text) {
  const double value = time_in(option, text);
  if (!(value >= 0)) bad_value(option, text, "it must not be negative", "write it like 2 or 500ms");
  return value;
}

std::int64_t integer_between(const std::string& option, const std::string& text, std::int64_t low,
                             std::int64_t high) {
  const std::optional<std::int64_t> value = parse_integer(text);
  const std::string range = high == std::numeric_limits<std::int64_t>::max()
                                ? "of at least " + std::to_string(low)
                                : "from " + std::to_string(low) + " to " + std::to_string(high);
  if (!value)
    bad_value(option, text, "it is not an integer, or too long", "give an integer " + range);
  if (*value < low || *value > high)
    bad_value(option, text, "it is out of range", "give an integer " + range);
  return *value;
}

LuaLimits lua_limits(const std::string& option, bool safe) {
  LuaLimits limits = safe ? safe_limits() : LuaLimits();
  limits.steps_in_all = true;
  const char* const variable = std::getenv("SIM_LUA_BUDGET");
  if (variable && *variable) limits = with_budget(limits, "SIM_LUA_BUDGET", variable);
  return with_budget(limits, "--lua-budget", option);
}

ParticleChoice particle_choice(const std::string& option, const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const std::string id = colon == std::string::npos ? text : text.substr(colon + 1);
  return {colon == std::string::npos ? "" : text.substr(0, colon),
          integer_between(option, id, 0, std::numeric_limits<std::int64_t>::max())};
}

double wall_time(const std::string& option, const std::string& text) {
  constexpr Unit kUnits[] = {{"ms", 1e-3}, {"min", 60}, {"h", 3600}, {"s", 1}};
  const std::optional<double> value = number_in(kUnits, text);
  if (!value || !(*value > 0) || !std::isfinite(*value))
    bad_value(option, text, "expected a time above 0", "write it like 30s, 5min or 1h");
  return *value;
}

void allow(study::VerificationPlan& plan, const std::string& option, const std::string& text) {
  if (!text.ends_with('%')) {
    plan.seconds = wall_time(option, text);
    return;
  }
  plan.share = positive_number(option, text.substr(0, text.size() - 1)) / 100;
}

std::string checkpoint_name(const std::string& option, const std::string& text) {
  if (text == "-") bad_value(option, text, "a checkpoint needs a file", "give the name of one");
  return text;
}

std::vector<std::string> comma_list(const std::string& option, const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t begin = 0; begin <= text.size() && !text.empty();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string name = text.substr(begin, end - begin);
    if (name.empty()) bad_value(option, text, "a name is missing", "write it like euler,rk4");
    words.push_back(name);
    begin = end + 1;
  }
  return words;
}

std::vector<std::string> command_words(const std::vector<std::string>& given) {
  std::vector<std::string> words;
  bool options_end = false;
  for (std::string word : given) {
    options_end = options_end || word == "--";
    if (!options_end &&
        (word == "--energy" || word == "--dump" || word == "--observe" || word == "--tension"))
      word += "=-";
    if (!options_end && word.starts_with("--") && word.find('=') == word.size() - 1)
      usage_error("empty value", word, "nothing follows the =", "give a value");
    words.push_back(word);
  }
  std::reverse(words.begin(), words.end());  // as CLI11 wants them
  return words;
}

std::map<std::string, std::string> settings(const std::vector<std::string>& texts) {
  std::map<std::string, std::string> result;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos)
      bad_value("--set", text, "it is not NAME=VALUE", "write it like --set n=16");
    if (!result.emplace(text.substr(0, equals), text.substr(equals + 1)).second)
      bad_value("--set", text, "this name is set twice", "keep one of them");
  }
  return result;
}

std::string only(const std::string& option, const std::vector<std::string>& texts) {
  if (texts.size() > 1)
    usage_error("given twice", option + " " + texts[1], "only one can hold",
                "sim compare shows several side by side");
  return texts.empty() ? "" : texts.front();
}

std::string once(const std::string& option, const std::string& argument) {
  const std::size_t equals = argument.find('=');
  if (equals != std::string::npos && is_lua_name(std::string_view(argument).substr(0, equals)))
    usage_error("unexpected argument", "'" + argument + "'",
                "each parameter of a scene stands behind an option of its own",
                "write -s " + argument);
  if (!option.empty() && !argument.empty())
    usage_error("given twice", "'" + argument + "' and '" + option + "'",
                "as an argument and as an option", "keep one of them");
  return option.empty() ? argument : option;
}

Threads threads_of(const std::string& text) {
  if (text != "auto") return static_cast<int>(integer_between("--threads", text, 1, kMostThreads));
  const std::int64_t cores = std::thread::hardware_concurrency();
  return {static_cast<int>(std::clamp<std::int64_t>(cores, 1, kMostThreads)), true};
}

ShowProgress show_progress(const std::string& text) {
  if (text == "on") return ShowProgress::kOn;
  if (text == "off") return ShowProgress::kOff;
  if (text != "auto")
    usage_error("bad value", "--progress '" + text + "'", "it is auto, on or off",
                "leave it out for auto");
  return ShowProgress::kAuto;
}

}  // namespace sim::cli
