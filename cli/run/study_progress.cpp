#include "cli/run/study_progress.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"

namespace sim::cli {

study::Watch StudyProgress::watch() {
  return [this](std::string_view what, double done) {
    mention_long(what, done);
    draw(what, done);
    return interrupts_.caught() == 0;
  };
}

// At most ten times a second.
void StudyProgress::draw(std::string_view what, double done) {
  constexpr double kWidth = 30;
  const Clock::time_point now = now_();
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

// After 2 s by what is done, or after 10 s; again where it takes twice as long as was said.
void StudyProgress::mention_long(std::string_view what, double done) {
  constexpr double kEarly = 2, kLong = 10, kSomething = 0.02, kAgain = 2;
  if (!said_) return;
  const double seconds = std::chrono::duration<double>(now_() - begin_).count();
  const double whole = done > kSomething ? seconds / done : 0;
  const double expected = std::max(seconds, whole);
  if (seconds < kEarly || expected < std::max(kLong, kAgain * told_seconds_)) return;
  told_seconds_ = expected;
  clear();
  err_ << "sim: note: " << what << ": " << percent(std::clamp(done, 0.0, 1.0), 1, 2)
       << " done after " << rough_time(seconds);
  if (whole > 0) err_ << ", about " << rough_time(whole - seconds) << " more";
  err_ << "; Ctrl-C ends it with what it has\n" << std::flush;
}

void StudyProgress::announce(double seconds) {
  constexpr double kWorthAWord = 1;
  if (!said_ || seconds < kWorthAWord) return;
  told_seconds_ = seconds;
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

void plan_plot(const std::optional<std::string>& svg, const SceneSpec& scene, FilePlan& plan) {
  if (!svg) return;
  if (scene.systems.size() > 1)
    throw Error(ErrorKind::kUsage, {"one plot for several systems", "--svg " + *svg,
                                    "the scene is a world", "name the file of one of its scenes"});
  plan.writes("--svg", *svg);
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
