// Values of options: each unit, each bound, and the figures in refusals.
#include "cli/command_line/option_values.h"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <limits>

#include "cli/command_line/view_options.h"
#include "core/base/error.h"

using namespace sim;
using namespace sim::cli;
using Catch::Contains;
using Catch::StartsWith;

namespace {

using Words = std::vector<std::string>;

class Variable {
 public:
  explicit Variable(const char* value) { setenv("SIM_LUA_BUDGET", value, 1); }
  ~Variable() { unsetenv("SIM_LUA_BUDGET"); }
};

}  // namespace

TEST_CASE("times of a scene and of the clock are read in every unit") {
  const std::pair<const char*, double> times[] = {
      {"5us", 5e-6},  {"5 us", 5e-6},     {"0.3ms", 0.3e-3}, {"7min", 420},  {"2h", 7200},
      {"2.5 s", 2.5}, {"1.5  min", 90.0}, {"0.005", 0.005},  {"1e-3", 1e-3}, {"-4s", -4}};
  for (const auto& [text, seconds] : times) {
    INFO(text);
    CHECK(seconds_of(text) == seconds);  // to the last bit
    if (seconds > 0) CHECK(positive_time("-T", text) == seconds);
  }
  for (const char* text : {"", "s", "5 km", "5m", "5 s s", "1e400s", "1e308h", "nan", "infs", "s5"})
    CHECK_FALSE(seconds_of(text));
  CHECK(non_negative_time("--from", "0") == 0);
  CHECK_THROWS_WITH(non_negative_time("--from", "-1us"),
                    StartsWith("bad value: --from '-1us': ") && Contains("must not be negative"));
  CHECK_THROWS_WITH(positive_time("-T", "0ms"),
                    StartsWith("bad value: -T '0ms': ") && Contains("above 0"));
  CHECK_THROWS_WITH(positive_number("-d", "0"),
                    StartsWith("bad value: -d '0': ") && Contains("above 0"));
  CHECK(positive_number("-d", "1e-300") == 1e-300);

  CHECK(wall_time("-v", "20ms") == Approx(0.02).epsilon(1e-15));
  CHECK(wall_time("-v", "3 min") == 180);
  CHECK(wall_time("-v", "2h") == 7200);
  CHECK(wall_time("-v", "30s") == 30);
  CHECK(wall_time("-v", "0.5") == 0.5);
  for (const char* text : {"0", "-1s", "5us", "1e308h", "x"})
    CHECK_THROWS_WITH(wall_time("-v", text), Contains("-v '" + std::string(text) + "'"));
}

TEST_CASE("time to verify is a time of the clock or a share of the run's") {
  study::VerificationPlan plan;
  allow(plan, "--verify-time", "50%");
  CHECK(plan.share == 0.5);
  CHECK(plan.seconds == 1);
  allow(plan, "--verify-time", "3min");
  CHECK(plan.share == 0.5);
  CHECK(plan.seconds == 180);
  CHECK_THROWS(allow(plan, "--verify-time", "0%"));
  CHECK_THROWS(allow(plan, "--verify-time", "%"));
}

TEST_CASE("integers are taken up to their bounds, which a refusal names") {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  for (const char* text : {"2", "3", "5"}) CHECK(integer_between("-n", text, 2, 5) == *text - '0');
  CHECK(integer_between("-n", "9223372036854775807", 0, kMost) == kMost);
  for (const char* text : {"1", "6", "-3"})
    CHECK_THROWS_WITH(integer_between("-n", text, 2, 5),
                      Contains("-n '" + std::string(text) + "': it is out of range") &&
                          Contains("an integer from 2 to 5"));
  CHECK_THROWS_WITH(integer_between("-n", "6", 7, kMost), Contains("an integer of at least 7"));
  CHECK_THROWS_WITH(integer_between("-n", "2.0", 2, 5),
                    Contains("not an integer") && Contains("an integer from 2 to 5"));
  CHECK(threads_of("1").most == 1);
  CHECK(threads_of("1024").most == 1024);
  CHECK_FALSE(threads_of("7").as_pay);
  for (const char* text : {"0", "1025"})
    CHECK_THROWS_WITH(threads_of(text), Contains("from 1 to 1024"));
  CHECK(threads_of("auto").as_pay);
  CHECK(threads_of("auto").most >= 1);

  const ParticleChoice alone = particle_choice("-p", "12"), two = particle_choice("-p", "a:b:0");
  CHECK((alone.system.empty() && alone.id == 12));
  CHECK((two.system == "a:b" && two.id == 0));
  for (const char* text : {"-1", "a:", "a", "a:1.5"}) CHECK_THROWS(particle_choice("-p", text));
}

TEST_CASE("limits of Lua come from the environment and from the command line, which is stronger") {
  const auto same = [](const LuaLimits& a, const LuaLimits& b) {
    return a.seconds == b.seconds && a.memory == b.memory && a.steps == b.steps &&
           a.seconds_in_all == b.seconds_in_all && a.steps_in_all == b.steps_in_all;
  };
  constexpr std::size_t kMB = std::size_t{1} << 20;
  CHECK(same(lua_limits(""), {.steps_in_all = true}));
  CHECK(same(lua_limits("", true),
             {.memory = 256 * kMB, .seconds_in_all = true, .steps_in_all = true}));
  CHECK(same(lua_limits("time=3"), {.seconds = 3, .seconds_in_all = true, .steps_in_all = true}));
  CHECK(same(lua_limits("memory=20,steps=1e6"),
             {.memory = 20 * kMB, .steps = 1000000, .steps_in_all = true}));
  CHECK(lua_limits("steps=0.5").steps == 1);
  CHECK(lua_limits("steps=1e15").steps == 1000000000000000);
  {
    const Variable variable("time=7,steps=50");
    const LuaLimits limits = lua_limits("steps=60");
    CHECK((limits.seconds == 7 && limits.steps == 60));
    CHECK_THROWS_WITH(lua_limits("time=0"), Contains("--lua-budget time"));
  }
  {
    const Variable variable("space=7");
    CHECK_THROWS_WITH(lua_limits("steps=60"), Contains("SIM_LUA_BUDGET 'space=7'"));
  }
  for (const char* text : {"time", "time=", "steps=1.1e15", "memory=0", "time=1,,steps=2", "=4"})
    CHECK_THROWS(lua_limits(text));
}

TEST_CASE("lists and settings are cut where their marks are") {
  CHECK(comma_list("-i", "a,bc,d") == Words{"a", "bc", "d"});
  CHECK(comma_list("-i", "a") == Words{"a"});
  CHECK(comma_list("-i", "").empty());
  for (const char* text : {",", "a,", ",a", "a,,b"})
    CHECK_THROWS_WITH(comma_list("-i", text), Contains("a name is missing"));
  const auto set = settings({"n=16", "text=a=b", "empty="});
  CHECK(set == std::map<std::string, std::string>{{"n", "16"}, {"text", "a=b"}, {"empty", ""}});
  for (const Words& texts : {Words{"n"}, {"=3"}, {"n=1", "n=2"}}) CHECK_THROWS(settings(texts));
  CHECK(only("-s", {}).empty());
  CHECK(only("-s", {"a"}) == "a");
  CHECK_THROWS_WITH(only("-s", {"a", "b"}), Contains("-s b"));
  CHECK(once("a", "") == "a");
  CHECK(once("", "b") == "b");
  CHECK_THROWS_WITH(once("a", "b"), Contains("'b' and 'a'"));
}

TEST_CASE("words of the command line are turned, and bare tables go to standard output") {
  CHECK(command_words({"run", "--dump", "x"}) == Words{"x", "--dump=-", "run"});
  for (const char* option : {"--energy", "--dump", "--observe", "--tension"}) {
    CHECK(command_words({option}) == Words{std::string(option) + "=-"});
    CHECK(command_words({"--", option}) == Words{option, "--"});
    const std::string empty = std::string(option) + "=";
    CHECK_THROWS_WITH(command_words({empty}), Contains(empty));
    CHECK(command_words({empty + "f"}) == Words{empty + "f"});
  }
  CHECK(command_words({"--", "--out="}) == Words{"--out=", "--"});
  CHECK(command_words({"-s", "text="}) == Words{"text=", "-s"});
  CHECK(command_words({"--set=a="}) == Words{"--set=a="});
  CHECK(show_progress("on") == ShowProgress::kOn);
  CHECK(show_progress("off") == ShowProgress::kOff);
  CHECK(show_progress("auto") == ShowProgress::kAuto);
  CHECK_THROWS_WITH(show_progress("yes"), Contains("'yes'"));
}

TEST_CASE("six methods fit side by side on the page, one is that of the scene") {
  const Words all{"verlet", "rk4", "euler", "rk3", "pefrl:precision=single", "midpoint", "dopri5"};
  const auto with = [&](std::size_t count, const ViewTexts& texts = {}) {
    return view_request(texts, {}, Words(all.begin(), all.begin() + std::ptrdiff_t(count)));
  };
  CHECK((with(0).compare.empty() && with(0).scene.integrator.name.empty()));
  CHECK((with(1).compare.empty() && with(1).scene.integrator.name == "verlet"));
  for (const std::size_t count : {2u, 5u, 6u}) {
    const ViewRequest request = with(count);
    REQUIRE(request.compare.size() == count);
    for (std::size_t k = 0; k < count; ++k)
      CHECK(request.compare[k].name == all[k].substr(0, all[k].find(':')));
    CHECK(request.scene.integrator.name.empty());
  }
  CHECK_THROWS_WITH(with(7), "too many panels: --integrator: six fit side by side; leave some out");
  ViewTexts recorded, window, terminal, both, closed, port;
  recorded.record = "a.rec";
  window.window = both.window = terminal.terminal = both.terminal = closed.no_open = true;
  CHECK(with(1, recorded).record == "a.rec");
  CHECK_THROWS_WITH(with(2, recorded), Contains("a recording is of a scene, not of a comparison"));
  CHECK_THROWS_WITH(with(1, both),
                    "two places to look: --window --terminal: it is seen in one; leave out one");
  CHECK((with(1, window).window && !with(1, terminal).window));
  CHECK((with(1, terminal).terminal && !with(1, window).terminal));
  CHECK((with(1).open && !with(1, closed).open));
  for (const char* const bad : {"0", "65536", "x"}) {
    port.port = bad;
    CHECK_THROWS(with(1, port));
  }
  port.port = "65535";
  CHECK(with(1, port).port == 65535);
}
