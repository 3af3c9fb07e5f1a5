// The figures that studies print, against closed forms of a free fall and of a spring.
#include <catch2/catch.hpp>
#include <cmath>
#include <regex>
#include <tuple>

#include "core/output/format.h"
#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

constexpr double kMass = 2, kGravity10 = 10, kStiffness = 50;  // kg, m/s^2, N/m
const double kOmega = std::sqrt(kStiffness / kMass);           // 5 rad/s
constexpr double kSag = kMass * kGravity10 / kStiffness;       // 0.4 m, the amplitude from rest
const double kPerNumber =
    1 / std::sqrt(3.0);  // errors are of the numbers x, y, z of free particles

// A particle that falls, with drag k; and one that hangs on a spring of 1 m and is let go there.
class Scenes {
 public:
  Scenes() {
    write_text(folder_.path() / "fall.lua",
               "local sim = require 'sim'\n"
               "local p = sim.particles { mass = 2 }\n"
               "p:add {0, 0, 0}\n"
               "return sim.scene { name = 'fall', particles = p,\n"
               "  forces = { sim.force.gravity { g = {0, -10, 0} },\n"
               "             sim.force.drag { k = sim.arg('k', 0.5, 'kg/s') } },\n"
               "  integrator = 'rk4', dt = 0.01, duration = 1 }\n");
    write_text(folder_.path() / "spring.lua",
               "local sim = require 'sim'\n"
               "local p = sim.particles { mass = 2 }\n"
               "local hook, bead = p:add {0, 0, 0}, p:add {0, -1, 0}\n"
               "p:pin(hook)\n"
               "local s = sim.force.spring { family = 'link', stiffness = 50 }\n"
               "s:tie(hook, bead)\n"
               "return sim.scene { name = 'spring', particles = p,\n"
               "  forces = { sim.force.gravity { g = {0, -10, 0} }, s },\n"
               "  integrator = 'verlet', dt = 0.01, duration = 1 }\n");
  }

  Outcome run(const std::vector<std::string>& words) const {
    Outcome outcome = run_sim(words, {.folder = folder_.path()});
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return outcome;
  }
  Json json(std::vector<std::string> words) const {
    words.emplace_back("--json");
    return JsonReader(run(words).out).read();
  }
  // The fields of the only case of a sweep, by their names.
  std::map<std::string, std::string> row(const std::vector<std::string>& words) const {
    const std::vector<std::string> lines = lines_of(run(words).out);
    REQUIRE(lines.size() == 2);
    const auto names = sim::csv_fields(lines[0]), fields = sim::csv_fields(lines[1]);
    std::map<std::string, std::string> row;
    for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = fields.at(i);
    return row;
  }

 private:
  TemporaryFolder folder_;
};

const Json& named(const Json& list, const std::string& key, const std::string& name) {
  for (const Json& each : list.list)
    if (each.at(key).text == name) return each;
  FAIL("there is no " << name);
  return list;
}

// Velocity Verlet swings as the spring does, at a rate of its own: cos(rate h) = 1 - (omega h)^2 /
// 2. The largest distance after a step of the first second, of one number.
double verlet_error(double h) {
  const double rate = std::acos(1 - 0.5 * kOmega * h * kOmega * h) / h;
  double most = 0;
  for (int i = 1; i * h < 1 + 0.5 * h; ++i)
    most = std::max(most, std::fabs(std::cos(rate * i * h) - std::cos(kOmega * i * h)));
  return kSag * most * kPerNumber;
}

// A study looks at all of few steps, and at some of many.
Approx verlet_error_seen(double h) {
  return Approx(verlet_error(h)).epsilon(h > 0.01 ? 1e-6 : 1e-3);
}

}  // namespace

TEST_CASE("minimal: what each part of a fall through air changes", "[cli]") {
  const Json study = Scenes().json({"minimal", "fall.lua", "-T", "1"});
  const double rate = 0.5 / kMass, end = 1 - std::exp(-rate);
  const double fallen = kGravity10 / rate * (1 - end / rate), speed = kGravity10 / rate * end;
  const double kinetic = 0.5 * kMass * speed * speed, potential = kMass * kGravity10 * fallen;
  const auto part = [&](const std::string& option) -> const Json& {
    return named(study.at("parts"), "option", option);
  };
  CHECK(part("--without gravity").at("change").number == Approx(fallen).epsilon(1e-9));
  CHECK(part("--without drag").at("change").number == Approx(5 - fallen).epsilon(1e-9));
  CHECK(part("-s k=0").at("change").number == Approx(5 - fallen).epsilon(1e-9));
  for (const char* option : {"--without gravity", "--without drag"})
    CHECK(part(option).at("energy").number ==
          Approx((potential - kinetic) / (potential + kinetic)).epsilon(1e-9));
  CHECK(study.at("budget").number == Approx(0.01));  // of 1 m, the size of a single point
  CHECK(study.at("whole").at("evaluations").number == 4 * 100);
  CHECK(part("-d 0.02").at("evaluations").number == 4 * 50);
  // Measured times decide what is best of the three that belong to it, which for one particle is
  // chance: a longer step, single precision, a method of fewer evaluations; none of them, if the
  // machine was busy with something else meanwhile.
  const std::string& command = study.at("command").text;
  CHECK(command.starts_with("sim fall.lua "));
  CHECK(command.ends_with("-T 1"));
  for (const char* word : {"--without", "-s k"}) CHECK(command.find(word) == std::string::npos);
  if (command == "sim fall.lua -T 1") return;
  const Json& smallest = study.at("smallest");
  CHECK(smallest.at("evaluations").number <= 4 * 100);
  CHECK(smallest.at("change").number <= 0.01);
  const auto has = [&](const char* word) { return command.find(word) != std::string::npos; };
  CHECK((has("-d ") || has("--precision single") || has("-i ")));
}

TEST_CASE("compare: each method with the error of a fall without air", "[cli]") {
  const Json study = Scenes().json({"compare", "fall.lua", "-s", "k=0", "-T", "1", "-d", "0.01",
                                    "-i", "euler", "-i", "symplectic_euler", "-i", "verlet"});
  // v_n = -g n h; y is the sum of h v before the change or after it: g h t / 2 above or below.
  for (const char* name : {"euler", "symplectic_euler"}) {
    const Json& method = named(study.at("methods"), "integrator", name);
    CHECK(method.at("most").number == Approx(0.05).epsilon(1e-9));
    CHECK(method.at("error").number == Approx(0.05 * kPerNumber).epsilon(1e-9));
    CHECK(method.at("error_end").number == Approx(0.05 * kPerNumber).epsilon(1e-9));
    CHECK(method.at("steps").number == 100);
    CHECK(method.at("evaluations").number == 100);
  }
  CHECK(named(study.at("methods"), "integrator", "verlet").at("most").number < 1e-12);
}

TEST_CASE("rest: where a weight on a spring comes to rest", "[cli]") {
  const Json study = Scenes().json({"rest", "spring.lua"});
  const double there = -kMass * kGravity10 * (1 + kSag) + 0.5 * kStiffness * kSag * kSag;
  CHECK(study.at("potential").number == Approx(there).epsilon(1e-12));
  CHECK(study.at("in_play").number == Approx(kMass * kGravity10).epsilon(1e-12));
  CHECK(study.at("force").number < 1e-12 * kMass * kGravity10);
}

TEST_CASE("stability: modes and limits of one spring", "[cli]") {
  const Json study = Scenes().json({"stability", "spring.lua"});
  CHECK(study.at("omega_max").number == Approx(kOmega).epsilon(1e-9));
  CHECK(study.at("bound").number == Approx(kOmega).epsilon(1e-9));
  CHECK(study.at("damping").number == 0);
  CHECK(study.at("growth").number == 0);
  CHECK(study.at("particles").list.front().at("particle").number == 1);
  CHECK(study.at("particles").list.front().at("share").number == Approx(1));
  const auto method = [&](const std::string& name) -> const Json& {
    return named(study.at("integrators"), "name", name);
  };
  const double z = 0.01 * kOmega, z2 = z * z;
  CHECK(method("verlet").at("predicted_dt").number == Approx(2 / kOmega).epsilon(1e-9));
  CHECK(method("verlet").at("measured_dt").number == Approx(2 / kOmega).epsilon(1e-3));
  CHECK(method("rk4").at("predicted_dt").number == Approx(2 * std::sqrt(2) / kOmega).epsilon(1e-6));
  CHECK(method("rk4").at("measured_dt").number == Approx(2 * std::sqrt(2) / kOmega).epsilon(1e-3));
  CHECK(method("bs23").at("predicted_dt").number == Approx(std::sqrt(3) / kOmega).epsilon(1e-6));
  CHECK(method("euler").at("measured_dt").number == 0);
  CHECK(method("euler").at("radius").number == Approx(std::hypot(1, z)).epsilon(1e-9));
  CHECK(method("implicit_euler").at("radius").number == Approx(1 / std::hypot(1, z)).epsilon(1e-9));
  CHECK(method("implicit_midpoint").at("radius").number == Approx(1).epsilon(1e-9));
  CHECK(method("midpoint").at("radius").number == Approx(std::hypot(1 - z2 / 2, z)).epsilon(1e-9));
  CHECK(method("rk4").at("radius").number ==
        Approx(std::hypot(1 - z2 / 2 + z2 * z2 / 24, z - z * z2 / 6)).epsilon(1e-9));
}

// With z = omega h and cos a = 1 - z^2/2 it is at x = A cos(n a) with v = omega A sqrt(1 - z^2/4)
// sin(n a): the energy is off by m omega^2 A^2 z^2/8 sin^2(n a).
TEST_CASE("stability: the energy that Verlet's method is off by near its limit", "[cli]") {
  const Json study = Scenes().json({"stability", "spring.lua", "--integrators",
                                    "verlet,rk4,euler,"
                                    "dopri5"});
  CHECK(study.at("system").text == "spring");
  CHECK(study.at("t").number == 0);
  CHECK(study.at("integrator").text == "verlet");
  CHECK(study.at("dt").number == 0.01);
  CHECK(study.at("energy_time").number == 1);
  CHECK(study.at("complete").flag);
  CHECK(study.at("decay").number == Approx(0).margin(1e-9));
  CHECK(study.at("residual").number < 1e-9);
  REQUIRE(study.at("families").list.size() == 1);
  CHECK(study.at("families").list[0].at("family").text == "link");
  CHECK(study.at("families").list[0].at("share").number == Approx(1));
  REQUIRE(study.at("particles").list.size() == 1);
  REQUIRE(study.at("integrators").list.size() == 4);
  const auto method = [&](const std::string& name) -> const Json& {
    return named(study.at("integrators"), "name", name);
  };
  const std::tuple<const char*, int, const char*, std::size_t> facts[] = {
      {"verlet", 2, "step", 4},
      {"rk4", 4, "step", 4},
      {"euler", 1, "none stable", 0},
      {"dopri5", 5, "own steps", 0}};
  for (const auto& [name, order, limit, points] : facts) {
    INFO(name);
    CHECK(method(name).at("order").number == order);
    CHECK(method(name).at("limit").text == limit);
    CHECK(method(name).at("energy").list.size() == points);
    CHECK_FALSE(method(name).at("late").flag);
  }
  const double limit = method("verlet").at("measured_dt").number;
  const double fractions[] = {0.25, 0.5, 0.9, 1.1};
  for (std::size_t k = 0; k < 4; ++k) {
    const Json& point = method("verlet").at("energy").list[k];
    INFO(fractions[k]);
    CHECK(point.at("fraction").number == fractions[k]);
    const double h = point.at("dt").number, z = kOmega * h;
    CHECK(h == Approx(fractions[k] * limit).epsilon(1e-12));
    if (k == 3) {
      // It grows, and is lost or off by more than there was.
      CHECK((point.at("error").kind == Json::Kind::kNull || point.at("error").number > 0.5));
      continue;
    }
    // An even number of steps, as many as the duration has room for, or one or two more.
    const double angle = std::acos(1 - z * z / 2), scale = kStiffness * kSag * kSag;
    const auto steps = static_cast<int>(std::ceil(1 / h / 2)) * 2;
    double most = 0, in_play = 0;
    for (int n = 1; n <= steps; ++n) {
      const double sine = std::sin(n * angle), cosine = std::cos(n * angle);
      const double kinetic = 0.5 * scale * (1 - z * z / 4) * sine * sine;
      const double potential = 0.5 * scale * (1 - cosine * cosine);  // below that of the start
      most = std::max(most, scale * z * z / 8 * sine * sine);
      in_play = std::max(in_play, kinetic + potential);
    }
    CHECK(point.at("error").number == Approx(most / in_play).epsilon(1e-6));
  }
  // The energy that rk4 loses in a time goes with z^5.
  const auto& points = method("rk4").at("energy").list;
  CHECK(points[1].at("error").number / points[0].at("error").number > 10);

  const std::string words =
      Scenes().run({"stability", "spring.lua", "--integrators", "verlet,euler,dopri5"}).out;
  const auto says = [&](const std::string& text) {
    INFO(words << "\n" << text);
    CHECK(words.find(text) != std::string::npos);
  };
  says("5 rad/s (period 1.26 s), damping 0 /s");  // 2 pi / 5
  says("5 rad/s, from masses and stiffnesses alone");
  says("mostly at particles 1; link 100 %");
  says("verlet, dt 0.01 s");
  says("energy error at share");
  says("of runs of 1 s, the largest, of the energy in play");
  // 2 / omega = 0.4 s, of which 0.01 s are 2.5 %; own steps; (1 + z^2)^(1/2) a step: e times in
  // h / (z^2 / 2) = 8 s.
  const auto row = [&](const std::string& name) {
    for (const std::string& line : lines_of(words))
      if (line.starts_with(name + " ")) return std::regex_replace(line, std::regex(" +"), " ");
    return std::string();
  };
  CHECK(row("verlet").starts_with("verlet 0.4 0.4 0 % 2.5 % "));
  CHECK(row("dopri5").ends_with(" own steps"));
  says("euler has no stable step here");
  says("the fastest mode grows e times every 8.01 s");
}

TEST_CASE("order and tradeoff: the errors of Verlet's method on a spring", "[cli]") {
  const Scenes scenes;
  const Json order =
      scenes.json({"order", "spring.lua", "verlet", "-T", "1"}).at("integrators").list.front();
  CHECK(order.at("points").list.size() > 5);
  for (const Json& point : order.at("points").list) {
    const double h = point.at("dt").number;
    if (h < 1e-3) continue;  // roundings of the closed form
    INFO(h);
    CHECK(point.at("error").number == verlet_error_seen(h));
    CHECK(point.at("evaluations").number == Approx(1 / h + 1));
  }
  // The first term of its expansion, omega^3 h^2 t / 24 of phase.
  CHECK(order.at("observed").number == Approx(2).epsilon(1e-3));
  CHECK(order.at("constant").number ==
        Approx(kSag * std::pow(kOmega, 3) / 24 * std::fabs(std::sin(kOmega)) * kPerNumber)
            .epsilon(0.01));

  const Json trade = scenes.json(
      {"tradeoff", "spring.lua", "-T", "1", "--integrators", "verlet", "--budget", "1 mm"});
  CHECK(trade.at("omega_max").number == Approx(kOmega).epsilon(1e-6));
  CHECK(trade.at("budget").number == Approx(1e-3));
  const Json& method = trade.at("integrators").list.front();
  CHECK(method.at("limit").number == Approx(2 / kOmega).epsilon(1e-3));
  CHECK(method.at("observed").number == Approx(2).epsilon(1e-3));
  double longest = 0;  // step that is good enough
  for (const Json& point : method.at("points").list) {
    const double h = point.at("dt").number;
    if (h < 1e-3) continue;
    INFO(h);
    CHECK(point.at("error").number == verlet_error_seen(h));
    CHECK(point.at("evaluations").number == Approx(1 / h + 1));
    if (verlet_error(h) <= 1e-3) longest = std::max(longest, h);
  }
  CHECK(longest == 0.025);
  CHECK(trade.at("cheapest").at("dt").number == longest);
  CHECK(trade.at("cheapest").at("evaluations").number == 41);
  CHECK(trade.at("cheapest").at("error").number == verlet_error_seen(longest));
  CHECK(trade.at("cheapest").at("command").text == "sim spring.lua -i verlet -d 0.025 -T 1");
}

TEST_CASE("tradeoff: neighbours on a circle stay as far from each other", "[cli]") {
  const Json trade = Scenes().json(
      {"tradeoff", "scenes/circle.lua", "-T", "1", "--integrators", "rk4", "--budget", "1 mm"});
  CHECK(trade.at("growth").number == Approx(1).epsilon(1e-6));
  CHECK(trade.at("omega_max").number == Approx(1).epsilon(1e-6));
  CHECK(trade.at("size").number == Approx(1).epsilon(1e-3));
}

TEST_CASE("sweep: the columns of a fall and of a spring", "[cli]") {
  const Scenes scenes;
  const auto number = [](const std::map<std::string, std::string>& row, const char* name) {
    INFO(name);
    REQUIRE(row.contains(name));
    return std::stod(row.at(name));
  };
  // v = -10 m/s, y = -(5 - 0.05) m: the energy rises by m g^2 h t / 2.
  const auto fall =
      scenes.row({"sweep", "fall.lua", "--over", "k=0", "-i", "euler", "-T", "1", "-d", "0.01"});
  CHECK(number(fall, "steps") == 100);
  CHECK(number(fall, "evaluations") == 100);
  CHECK(number(fall, "t") == Approx(1).epsilon(1e-12));
  CHECK(number(fall, "kinetic") == Approx(100).epsilon(1e-12));
  CHECK(number(fall, "potential") == Approx(-99).epsilon(1e-12));
  CHECK(number(fall, "total") == Approx(1).epsilon(1e-9));
  CHECK(number(fall, "drift") == Approx(1).epsilon(1e-9));
  CHECK(number(fall, "energy") == Approx(1.0 / 199).epsilon(1e-9));
  CHECK(number(fall, "dt_share") == 0);
  CHECK(number(fall, "error") == Approx(0.05).epsilon(1e-9));

  // Half a swing, 0.2 pi s: down to 1.8 m, at rest again.
  const auto spring = scenes.row(
      {"sweep", "spring.lua", "--over", "dt=0.001", "-T", std::to_string(0.2 * std::acos(-1.0))});
  CHECK(number(spring, "strain") == Approx(2 * kSag).epsilon(1e-4));
  CHECK(number(spring, "kinetic") == Approx(0).margin(1e-6));
  CHECK(number(spring, "potential") == Approx(-20).epsilon(1e-6));
  CHECK(number(spring, "dt_share") == Approx(0.001 * kOmega / 2).epsilon(1e-3));
}
