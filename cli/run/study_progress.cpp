#include "cli/run/study_progress.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"

namespace sim::cli {

std::string rough_time(double seconds) {
  constexpr double kMinute = 60, kHour = 3600;
  const auto told = [](double amount, const char* unit) {
    return brief(amount, amount < 10 ? 1 : 2) + unit;
  };
  if (seconds < 95) return told(seconds, " s");
  if (seconds < 95 * kMinute) return told(seconds / kMinute, " min");
  return brief(std::round(seconds / kHour)) + " h";
}

study::Watch StudyProgress::watch() {
  return [this](std::string_view what, double done) {
    draw(what, done);
    return interrupts_.caught() == 0;
  };
}

// At most ten times a second.
void StudyProgress::draw(std::string_view what, double done) {
  constexpr double kWidth = 30;
  const Clock::time_point now = Clock::now();
  if (!on_ || now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  const double part = std::clamp(done, 0.0, 1.0);
  const std::string bar(static_cast<std::size_t>(part * kWidth), '#');
  put_control(err_, "\r");
  err_ << "[" << left(bar, static_cast<std::size_t>(kWidth)) << "] "
       << right(brief(100 * part, 3), 4) << " %  " << what;
  put_control(err_, "\x1b[K");
  err_ << std::flush;
  drawn_ = true;
}

void StudyProgress::announce(double seconds) {
  constexpr double kWorthAWord = 1;
  if (!said_ || seconds < kWorthAWord) return;
  err_ << "sim: note: the study takes about " << rough_time(seconds)
       << "; Ctrl-C ends it with what it has\n"
       << std::flush;
}

int StudyProgress::exit_code() {
  clear();
  if (caught() == 0) return 0;
  err_ << "interrupted: this is what was measured until then\n" << std::flush;
  return 128 + caught();
}

void StudyProgress::clear() {
  if (drawn_) put_control(err_, "\r\x1b[K");
  err_ << std::flush;
  drawn_ = false;
}

std::vector<MethodChoice> study_choices(const std::vector<MethodChoice>& given,
                                        Registry& registry) {
  std::vector<MethodChoice> choices;
  for (const MethodChoice& choice : given) choices.push_back(typed(choice, choice.name, registry));
  return choices;
}

void put_studies(const std::vector<std::string>& texts, bool json, bool world, Console& console) {
  if (!json) {
    put(console.out, join(texts, "\n"));
  } else if (world) {
    put(console.out, JsonObject().json("systems", json_array(texts)).str() + '\n');
  } else if (!texts.empty()) {
    put(console.out, texts.front() + '\n');
  }
  flush_or_throw(console.out, "standard output");
}

}  // namespace sim::cli
