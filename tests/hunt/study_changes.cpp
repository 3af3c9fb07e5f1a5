// Claims of studies about stable steps, parts of a scene, rest and rows of tables.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/study/accuracy/trajectory.h"
#include "core/study/limits/step_limit.h"
#include "core/study/rest.h"
#include "core/study/verdict/refined_run.h"
#include "core/study/without.h"
#include "tests/hunt/studies.h"
#include "tests/support/scenes.h"

namespace sim_test {
namespace {

double value(const Json& json, const char* key) {
  return json.has(key) && json.at(key).kind == Json::Kind::kNumber ? json.at(key).number
                                                                   : std::nan("");
}

// How much a small disturbance grows in so many steps, at most: of a system at rest, which only
// that moves, or what touches it.
double growth_at_rest(sim::study::Standstill& place, const std::string& method, double h, int steps,
                      Random& random) {
  constexpr int kFirst = 10;
  constexpr double kSmall = 1e-6;
  sim::Simulation system = place.problem().with({method}).simulation(h),
                  other = place.problem().with({method}).simulation(h);
  const double size = sim::study::scene_size(system);
  for (int i = 0; i < system.particles(); ++i) {
    if (system.pinned(i)) continue;
    system.set_velocity(i, sim::Vec3::Zero());
    other.set_velocity(i, sim::Vec3::Zero());
    system.set_position(i, system.position(i) + random.vector(kSmall * size));
  }
  const auto apart = [&] {
    return distance(sim::study::positions(system), sim::study::positions(other), 3);
  };
  double first = apart(), most = 0;
  for (int step = 0; step < steps; ++step) {
    if (!system.step() || !other.step()) return HUGE_VAL;
    if (step < kFirst) first = std::max(first, apart());
    most = std::max(most, apart());
  }
  return most / first;
}

// A flat system held at its state, as particles are by loads: x' = f(x) - f(x_0), at one time.
// Steps from there have the limits of the system made linear. Empty where states have other
// numbers.
std::optional<sim::SystemSpec> held(const sim::SystemSpec& spec, sim::Registry& registry) {
  const auto own = std::make_shared<sim::Simulation>(
      spec, registry, sim::RunOptions{.integrator = {"rk4"}, .dt = spec.dt});
  const State start = sim::study::state_of(*own);
  const std::size_t n = start.size();
  if (own->ode().size() != n) return {};
  const auto x = std::make_shared<sim::Array>(n), y = std::make_shared<sim::Array>(n),
             rate = std::make_shared<sim::Array>(n);
  const auto slope = [own, x, y, rate, t = own->t()](std::span<const double> at) {
    std::ranges::copy(at, x->data());
    own->ode().eval(t, {x->data(), {}}, y->data(), rate->data());
    return std::span<const double>(rate->data(), at.size());
  };
  const std::span<const double> at_start = slope(start);
  const State first(at_start.begin(), at_start.end());
  const sim::OdeFunction f = [slope, first](double, std::span<const double> at,
                                            std::span<double> out) {
    std::ranges::transform(slope(at), first, out.begin(), std::minus());
  };
  sim::SystemSpec still = spec;
  still.observers.clear();
  still.first_order = sim::FirstOrderSpec{1, start, make_part("lua", {{"f", f}})};
  return still;
}

// The growth of a small disturbance of a flat state by one step: the largest eigenvalue of the
// step's derivative, by central differences.
double growth_of_step(const sim::SystemSpec& spec, const std::string& method, double h,
                      sim::Registry& registry) {
  sim::Simulation system(spec, registry, {.integrator = {method}, .dt = h});
  const State x = sim::study::state_of(system);
  double size = 1e-3;
  for (const double each : x) size = std::max(size, std::abs(each));
  const double small = 1e-6 * size;
  const auto n = static_cast<Eigen::Index>(x.size());
  Eigen::MatrixXd derivative(n, n);
  const auto stepped = [&](std::size_t changed, double by) {
    system.reset();
    for (std::size_t i = 0; i < x.size(); ++i)
      system.set_component(static_cast<int>(i), i == changed ? x[i] + by : x[i]);
    return system.step() ? sim::study::state_of(system) : State{};
  };
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto changed = static_cast<std::size_t>(k);
    const State above = stepped(changed, small), below = stepped(changed, -small);
    if (above.empty() || below.empty()) return HUGE_VAL;
    for (Eigen::Index i = 0; i < n; ++i)
      derivative(i, k) =
          (above[static_cast<std::size_t>(i)] - below[static_cast<std::size_t>(i)]) / (2 * small);
  }
  return derivative.eigenvalues().cwiseAbs().maxCoeff();
}

}  // namespace

void StudiedScene::check_stability() {
  const std::vector<std::string> names = some_methods(4);
  const auto found =
      ask("stability", {"--integrators", sim::join(names, ","), "--progress", "off"});
  if (!found) return;
  const bool flat = !spec_.particles.has_value() && spec_.first_order.has_value();
  sim::Simulation system(spec_, registry_);
  const sim::study::Problem problem{&spec_, &registry_};
  std::optional<sim::study::Standstill> place;
  if (!flat) place.emplace(problem, system);
  const std::optional<sim::SystemSpec> still =
      flat ? held(spec_, registry_) : std::optional<sim::SystemSpec>();
  const double own_growth = value(*found, "growth"), omega = value(*found, "omega_max");
  for (const Json& method : found->at("integrators").list) {
    const std::string name = method.at("name").text, limit = method.at("limit").text;
    if (limit == "own steps" || limit == "unknown" || name == "bdf2") continue;
    if (name == "imex") continue;  // its limit is that of one partition, and each step has its own
    const double measured = value(method, "measured_dt");
    const double h = std::isnan(measured) ? value(method, "predicted_dt") : measured;
    // Beside a growth of the system's own nothing is to be seen.
    constexpr double kLittle = 0.01, kMuch = 10, kRounding = 1e-7;
    const auto growth = [&](double step, bool expected) -> std::optional<double> {
      constexpr int kSteps = 400, kMoreSteps = 4000;
      // Bodies turn on, what a moving collider has met flies on, wind that changes moves a cloth
      // far from rest, and what has a limit by damping alone hardly grows beyond it.
      const bool moves = text_.find("motion =") != std::string::npos ||
                         text_.find("breeze =") != std::string::npos;
      constexpr const char* kDamped[] = {"euler", "midpoint", "trapezoid"};
      const bool slow = expected && std::ranges::find(kDamped, name) != std::end(kDamped);
      const bool drifts = moves || kind_ == "bodies" || slow;
      if (!flat && drifts) return {};
      try {
        if (flat && own_growth * step > (expected ? kRounding : kLittle)) return {};
        if (flat && !still) return {};
        if (flat) return growth_of_step(*still, name, step, registry_);
        const int steps = expected ? kMoreSteps : kSteps;
        if (own_growth * step * steps > 0.5) return {};
        const double grown = growth_at_rest(*place, name, step, steps, random_);
        if (expected || !(grown > kMuch)) return grown;
        // An instability grows on, unless it is large; what much smaller steps have, too, is the
        // system's own.
        constexpr int kFiner = 8;
        constexpr double kLarge = 1000, kOn = 2;
        if (grown < kLarge && growth_at_rest(*place, name, step, 2 * steps, random_) < kOn * grown)
          return 1;
        if (growth_at_rest(*place, name, step / kFiner, kFiner * steps, random_) > kMuch) return {};
        return grown;
      } catch (const sim::Error&) {
        return {};
      }
    };
    const auto check = [&](double step, bool grown) {
      const std::optional<double> truth = growth(step, grown);
      if (!truth)
        ++tally().unknown;
      else
        claim((*truth > (flat ? 1 + kRounding + own_growth * step : kMuch)) == grown,
              name + ": " + limit + (limit == "step" ? " " + sim::brief(h, 4) : "") + ", at " +
                  sim::brief(step, 4) + " s a disturbance grows by x" + sim::brief(*truth, 3));
    };
    if (limit == "step") {
      check(0.9 * h, false);
      check(1.1 * h, true);  // at 1.17 times the first, pefrl has a second interval
    } else if (limit == "unlimited") {
      check(20 * value(*found, "dt"), false);
    } else if (limit == "none stable" && omega > 0) {
      check(1 / omega, true);
    }
  }
}

void StudiedScene::check_minimal() {
  const auto found = ask("minimal", {"--progress", "off"});
  if (!found) return;
  constexpr int kLooks = 50;
  const double time = value(*found, "time");
  const CourseTask task{time, kLooks, sim::study::positions};
  const std::size_t width = spec_.first_order ? 1 : 3;
  const auto truth = motion_of(spec_, task, Patience(), registry_);
  const SeenCourse own = course_of(spec_, {}, task, Patience(), registry_);
  if (!truth || !own.finished) {
    ++tally().unknown;
    return;
  }
  const auto apart = [&](const SeenCourse& seen) {
    double most = seen.finished ? 0 : HUGE_VAL;
    for (std::size_t k = 0; k < seen.states.size(); ++k)
      most = std::max(most, distance(seen.states[k], truth->states[k], width));
    return most;
  };
  const double budget = value(*found, "budget");
  const double numbers = static_cast<double>(truth->states.front().size());
  const double slack = apart(own) + std::sqrt(numbers) * *std::ranges::max_element(truth->unknown);
  // The change of a scene by words of the command line.
  const auto changed = [&](const std::string& words) -> std::optional<double> {
    std::istringstream in(words);
    std::map<std::string, std::string> settings;
    std::vector<std::string> without;
    sim::RunOptions options;
    for (std::string option, word; in >> option;) {
      if (!option.starts_with("-")) continue;
      in >> word;
      if (option == "--without") without.push_back(word);
      if (option == "-s")
        settings[word.substr(0, word.find('='))] = word.substr(word.find('=') + 1);
      if (option == "-d") options.dt = std::strtod(word.c_str(), nullptr);
      if (option == "-i") options.integrator.name = word;
      if (option == "--precision") options.integrator.given["precision"] = word;
    }
    sim::SceneSpec scene;
    scene.systems.push_back(system_of(text_, registry_, settings));
    for (const std::string& name : without) sim::study::leave_out(name, scene);
    const SeenCourse seen = course_of(scene.systems.front(), options, task, Patience(), registry_);
    return apart(seen);
  };
  const auto check = [&](const std::string& words, bool within) {
    double change = HUGE_VAL;
    try {
      change = *changed(words);
    } catch (const sim::Error&) {  // there is no such scene
    }
    const std::string said = words + (within ? " keeps" : " does not keep") + " the budget " +
                             sim::brief(budget, 3) + ": changes " + sim::brief(change, 3) +
                             " known to " + sim::brief(slack, 2);
    if (!(slack < 0.5 * budget))
      ++tally().unknown;
    else if (within)
      claim(change <= 1.1 * budget + slack, said);
    else
      claim(change >= 0.9 * budget - slack, said);
  };
  for (const Json& part : found->at("parts").list)
    check(part.at("option").text, part.at("within").flag);
  if (found->at("smallest").kind == Json::Kind::kObject) check(found->at("command").text, true);
}

// Kicked, it never moves faster: energy above that of rest is needed for it anywhere near.
bool StudiedScene::rises_from_rest(sim::Simulation& system, const sim::SystemSpec& spec) {
  constexpr double kSpeed = 1e-2, kMore = 1.1;  // of the size a second
  const double size = sim::study::scene_size(system);
  for (int i = 0; i < system.particles(); ++i)
    if (!system.pinned(i)) system.set_velocity(i, random_.vector(kSpeed * size));
  // Steps in which gravity changes speeds by little beside those of the kick.
  constexpr int kFiner = 16;
  system.set_dt(spec.dt / kFiner);
  const double start = system.energy().kinetic;
  const Patience patience(3);
  for (double most = start; system.t() < spec.duration && !patience.over();) {
    if (!system.step()) return false;
    most = std::max(most, system.energy().kinetic);
    if (most > kMore * start) return false;
  }
  return true;
}

void StudiedScene::check_rest() {
  study_ = "rest";
  if (spec_.first_order) return;
  sim::Simulation system(spec_, registry_);
  const Patience patience;
  sim::study::Rest rest;
  try {
    rest = sim::study::come_to_rest(system, [&] { return patience.over(); });
  } catch (const sim::Error&) {}
  if (!rest.found) {
    ++(patience.over() ? tally().set_aside : tally().refused);
    return;
  }
  const auto has = [&](const char* word) { return text_.find(word) != std::string::npos; };
  const bool conserved = !has("colliders =") && !has("constraints =") && !has("sim.contact") &&
                         !has("wind") && !has("fx =") && !has("sim.rigid");
  if (conserved) {  // F = -dU/dx by differences
    double most = 0;
    const double step = 1e-6 * sim::study::scene_size(system);
    for (int i = 0; i < system.particles(); ++i) {
      if (system.pinned(i)) continue;
      sim::Vec3 force{0, 0, 0};
      const sim::Vec3 x = system.position(i);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        double u[2];
        for (const int side : {0, 1}) {
          sim::Vec3 moved = x;
          moved[axis] += side == 0 ? -step : step;
          system.set_position(i, moved);
          u[side] = system.energy().potential;
        }
        force[axis] = (u[0] - u[1]) / (2 * step);
      }
      system.set_position(i, x);
      most = std::max(most, force.norm());
    }
    claim(most <= rest.force + 1e-5 * rest.in_play + 1e-9, "a force of " + sim::brief(most, 3) +
                                                               " N is left, told " +
                                                               sim::brief(rest.force, 3) + " N");
  }
  if (has("wind")) return;
  const sim::Snapshot before = system.snapshot();
  try {
    const bool rises = rises_from_rest(system, spec_);
    claim(rises, "a kick gains energy");
  } catch (const sim::Error&) {  // bodies and rods take no such velocities
    system.restore(before);
    const State start = sim::study::positions(system);
    for (int i = 0; i < 100 && system.step(); ++i) {}
    const double moved = distance(sim::study::positions(system), start, 3);
    claim(moved < 1e-4 * sim::study::scene_size(system),
          "it moves by " + sim::brief(moved, 3) + " m in 100 steps");
  }
}

void StudiedScene::check_sweep() {
  const std::vector<std::string> names = some_methods(2);
  const std::string h = sim::shortest(spec_.dt), half = sim::shortest(spec_.dt / 2);
  const std::vector<std::vector<std::string>> sweeps{
      {"--over", "heavy=0.8,1,1.25"},
      {"--over", "integrator=" + sim::join(names, ","), "--over", "dt=" + half + "," + h}};
  for (std::vector<std::string> words : sweeps) {
    words.insert(words.end(), {"-j", "1", "--progress", "off"});
    const auto table = answer("sweep", words);
    if (!table) continue;
    const std::vector<std::string> lines = lines_of(*table);
    const std::vector<std::string> columns = sim::csv_fields(lines.front());
    for (std::size_t row = 1; row < lines.size(); ++row) {
      const std::vector<std::string> fields = sim::csv_fields(lines[row]);
      const auto field = [&](const std::string& name) {
        return fields.at(
            static_cast<std::size_t>(std::ranges::find(columns, name) - columns.begin()));
      };
      std::vector<std::string> single{file_, "--json", "-j", "1"};
      if (std::ranges::count(columns, "heavy"))
        single.insert(single.end(), {"-s", "heavy=" + field("heavy")});
      for (const auto& [name, option] : {std::pair{"integrator", "-i"}, {"dt", "-d"}})
        if (words[1].starts_with("integrator")) single.insert(single.end(), {option, field(name)});
      const Outcome outcome = limited_run(single);
      const std::string code = std::to_string(outcome.code);
      std::string unlike;
      const auto compare = [&](const std::string& what, const std::string& told,
                               const std::string& truth) {
        if (told != truth) unlike += ", " + what + " " + told + " for " + truth;
      };
      compare("exit", field("exit"), code);
      if (outcome.code == 0) {
        const Json run = read_json(outcome.out);
        const Json& system = run.at("systems").list.front();
        compare("hash", field("hash"), system.at("hash").text);
        compare("steps", field("steps"), std::to_string(static_cast<long>(value(system, "steps"))));
        const std::string verdict = system.at("verdict").text;
        if (field("verdict") != "unverified" && verdict != "unverified")
          compare("verdict", field("verdict"), verdict);
        if (system.has("energy"))
          compare("total", field("total"), sim::shortest(value(system.at("energy"), "end")));
      }
      claim(unlike.empty(), lines[row] + unlike);
    }
  }
}

}  // namespace sim_test
