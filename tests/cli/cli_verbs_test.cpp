// list, describe, doctor, --help, --version and the folders they look in.
#include <algorithm>
#include <catch2/catch.hpp>
#include <iterator>
#include <map>
#include <regex>
#include <sstream>

#include "core/simd/simd_targets.h"
#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/scenes.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

std::vector<std::string> names_of(const Json& list) {
  std::vector<std::string> names;
  for (const Json& entry : list.list) names.push_back(entry.at("name").text);
  return names;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

TEST_CASE("--help starts with three examples and fits a terminal") {
  const Outcome outcome = run_sim({"--help"});
  CHECK(outcome.code == 0);
  CHECK(outcome.err.empty());
  const auto lines = lines_of(outcome.out);
  REQUIRE(lines.size() > 10);
  CHECK(lines[0] == "Examples:");
  for (std::size_t i = 1; i < 4; ++i) CHECK(lines[i].rfind("  sim", 0) == 0);
  for (const char* option : {"--integrator", "--dt", "--time", "--steps", "--set", "--seed",
                             "--threads", "--debug-particle", "--energy", "--dump", "--every",
                             "--json", "--quiet", "--progress", "--plugin-path", "--load"})
    CHECK(outcome.out.find(option) != std::string::npos);
  for (const std::string& line : lines) CHECK(line.size() <= 80);
  for (const char* verb : {"adjacency", "compare", "describe", "doctor", "explain", "export",
                           "import", "list", "minimal", "order", "plot", "plugin", "rest", "scene",
                           "stability", "sweep", "test", "tradeoff", "view"}) {
    const Outcome help = run_sim({verb, "--help"});
    CHECK(help.code == 0);
    for (const std::string& line : lines_of(help.out)) {
      INFO(verb << ": " << line);
      CHECK(line.size() <= 80);
    }
  }
}

// The first words of each clause that runs of several kinds end with.
TEST_CASE("explain knows every clause of the verdicts of the shipped scenes") {
  const Outcome page = run_sim({"explain", "verdict"});
  CHECK(page.code == 0);
  const auto lines = lines_of(page.out);
  for (const std::string& line : lines) CHECK(line.size() <= 80);
  const auto explained = [&](const std::string& clause) {
    const std::string words = clause.substr(0, clause.find_first_of("0123456789-("));
    return std::ranges::any_of(lines, [&](const std::string& line) {
      return line.starts_with(words) || line.find(", " + words) != std::string::npos;
    });
  };
  for (const char* scene : {"cloth", "bounce", "stack", "rope", "circle", "flag", "hoop"}) {
    const Outcome run = run_sim({std::string("scenes/") + scene + ".lua", "-T", "0.1"});
    const std::string line = lines_of(run.err).back();
    CHECK(explained(line.substr(0, line.find(':'))));
    std::istringstream clauses(line.substr(line.find(": ") + 2));
    for (std::string clause; std::getline(clauses, clause, ',');) {
      clause.erase(0, clause.find_first_not_of(' '));
      INFO(line << "\nclause: " << clause);
      CHECK(explained(clause));
    }
  }
  CHECK(run_sim({"explain"}).code == 2);
  CHECK(run_sim({"explain", "weather"}).code == 2);
}

TEST_CASE("--version names commit, compiler, plugin ABI and instruction set") {
  const Outcome outcome = run_sim({"--version"});
  CHECK(outcome.code == 0);
  CHECK(outcome.out.rfind("sim ", 0) == 0);
  for (const char* part : {"commit ", "plugin ABI "})
    CHECK(outcome.out.find(part) != std::string::npos);
  for (const sim::SimdLevel level : sim::simd_levels()) {
    const std::string name = sim::simd_name(level);
    const Outcome forced = run_sim({"--version"}, {.environment = {{"SIM_SIMD", name}}});
    CHECK(forced.out.ends_with(", " + name + ")\n"));
  }
}

TEST_CASE("list shows plugins and scenes") {
  const Json all = read_json(run_sim({"list", "--json"}).out);
  CHECK(all.keys == std::vector<std::string>{"integrators", "forces", "fields", "colliders",
                                             "motions", "writers", "view", "constraints", "studies",
                                             "engines", "contact", "laws", "solvers", "scenes"});
  for (const char* name : {"euler", "trapezoid", "rk4"})
    CHECK(contains(names_of(all.at("integrators")), name));
  for (const char* name : {"gravity", "drag", "spring"})
    CHECK(contains(names_of(all.at("forces")), name));
  CHECK(contains(names_of(all.at("fields")), "rotation"));
  for (const char* name : {"circle", "pendulum", "pendulum1", "cloth", "sample"})
    CHECK(contains(names_of(all.at("scenes")), std::string("scenes/") + name + ".lua"));

  const Outcome text = run_sim({"list", "integrators"});
  CHECK(text.out.rfind("integrators\n", 0) == 0);
  CHECK(text.out.find("rk4 (r)") != std::string::npos);
  const auto row_of = [&](const std::string& name) {
    for (const std::string& line : lines_of(text.out))
      if (line.rfind("  " + name + ' ', 0) == 0) return line;
    return std::string();
  };
  const auto has = [&](const std::string& name, std::initializer_list<const char*> words) {
    std::istringstream line(row_of(name));
    const std::vector<std::string> cells{std::istream_iterator<std::string>(line), {}};
    for (const char* word : words)
      if (!contains(cells, word)) return false;
    return !cells.empty();
  };
  CHECK(has("rk4", {"4", "2.828", "2.785", "explicit"}));
  CHECK(has("euler", {"1", "none", "2"}));
  CHECK(has("verlet", {"2", "1", "any", "symplectic,", "particles"}));
  CHECK(text.out.find("forces") == std::string::npos);
  for (const std::string& line : lines_of(run_sim({"list"}).out)) CHECK(line.size() <= 80);
}

// The page of the scene language, against the registrations.
TEST_CASE("the page of the scene language has every plugin of scenes with all of its parameters") {
  const std::string page = run_sim({"list", "--markdown"}).out;
  const std::vector<std::string> lines = lines_of(page);
  CHECK(lines.front() == "## Functions");
  std::map<std::string, std::pair<std::size_t, std::size_t>> sections;  // their lines
  std::string last;
  std::size_t fences = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].starts_with("```")) CHECK(lines[i] == (fences++ % 2 ? "```" : "```text"));
    if (!lines[i].starts_with("##") || fences % 2) continue;
    if (!last.empty()) sections[last].second = i;
    last = lines[i].starts_with("### ") ? lines[i].substr(4) : "";
    INFO(lines[i]);
    if (!last.empty()) CHECK(sections.emplace(last, std::pair(i, lines.size())).second);  // once
    CHECK(lines[i + 1].empty());
  }
  CHECK(fences % 2 == 0);
  const auto one_line = [](std::string text) {
    std::ranges::replace(text, '\n', ' ');
    return std::regex_replace(text, std::regex("\\|"), "\\|");
  };
  const auto joined = [](const std::vector<std::string>& words, const std::string& between) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
    return text;
  };
  sim::Registry registry = make_registry();
  std::size_t plugins = 0, functions = 0;
  for (const sim::PluginKind& kind : sim::kPluginKinds) {
    const std::string group = "sim." + std::string(kind.name);
    const std::vector<std::string> names = registry.names(kind);
    CHECK((page.find("\n## " + group + "\n\n### " + group + ".") != std::string::npos) ==
          (kind.in_scenes && !names.empty()));
    for (const std::string& name : names) {
      const std::string title = group + "." + name;
      INFO(title);
      CHECK(sections.contains(title) == kind.in_scenes);
      if (!sections.contains(title)) continue;
      ++plugins;
      const sim::PluginInfo& info = registry.get(kind, name);
      std::string expected = "### " + title + "\n\n" + info.summary + ".";
      if (!info.aliases.empty()) expected += " Also: `" + joined(info.aliases, "`, `") + "`.";
      expected += "\n\n";
      if (!info.formula.empty()) expected += "```text\n" + info.formula + "\n```\n\n";
      if (!info.source.empty()) expected += "Source: " + info.source + ".\n\n";
      if (!info.params.empty())
        expected += "| parameter | unit | default | meaning |\n|---|---|---|---|\n";
      for (const sim::Param& param : info.params) {
        std::string value = param.required ? "required" : sim::to_text(param.default_value);
        if (!param.choices.empty()) value += " (" + joined(param.choices, ", ") + ")";
        if (param.per_tie) value += "; by tie";
        expected += "| `" + param.name + "` | " + param.unit + " | " + one_line(value) + " | " +
                    one_line(param.doc) + " |\n";
      }
      if (!info.params.empty()) expected += "\n";
      const auto [begin, end] = sections[title];
      CHECK(joined({lines.begin() + static_cast<std::ptrdiff_t>(begin),
                    lines.begin() + static_cast<std::ptrdiff_t>(end)},
                   "\n") +
                "\n" ==
            expected);
    }
  }
  // All other headings are functions and methods, which the text below calls by that name.
  for (const auto& [title, place] : sections) {
    if (std::ranges::count(title, '.') == 2) continue;
    ++functions;
    INFO(title);
    CHECK(lines[place.first + 2] == "```text");
    std::string text;
    for (std::size_t i = place.first + 3; i < place.second; ++i) text += lines[i] + "\n";
    CHECK(text.find(title) != std::string::npos);
    CHECK(text.find("\n```\n") + 5 == text.find_last_not_of('\n') + 2);
    const bool method = lines[place.first + 3].find(title) != std::string::npos && title[0] == ':';
    CHECK((method || title.starts_with("sim.")));
  }
  CHECK(plugins > 50);
  CHECK(functions > 15);
  CHECK(sections.size() == plugins + functions);
}

TEST_CASE("every plugin and scene describes itself") {
  const Json all = read_json(run_sim({"list", "--json"}).out);
  for (const std::string& section : all.keys)
    for (const std::string& name : names_of(all.at(section))) {
      INFO(name);
      const Outcome text = run_sim({"describe", name});
      CHECK(text.code == 0);
      CHECK(text.out.find(name) != std::string::npos);
      const Json facts = read_json(run_sim({"describe", name, "--json"}).out);
      if (section == "scenes") {
        CHECK(!facts.at("systems").list.empty());
        continue;
      }
      CHECK(!facts.at("summary").text.empty());
      CHECK(!facts.at("formula").text.empty());
      if (facts.has("order")) {  // auto has none of its own
        const int order = static_cast<int>(facts.at("order").number);
        CHECK((text.out.find(", order " + std::to_string(order)) != std::string::npos) ==
              (order > 0));
        const int evaluations = static_cast<int>(facts.at("evaluations").number);
        CHECK((text.out.find(" of f a step") != std::string::npos) == (evaluations > 0));
        if (evaluations > 0)
          CHECK(text.out.find(", " + std::to_string(evaluations) + " evaluation" +
                              (evaluations == 1 ? "" : "s") + " of f a step") != std::string::npos);
      }
      for (const Json& param : facts.at("params").list) CHECK(!param.at("doc").text.empty());
    }
}

TEST_CASE("describe knows orders, aliases and the parameters of a scene") {
  const Json rk4 = read_json(run_sim({"describe", "r", "--json"}).out);
  CHECK(run_sim({"describe", "rk4"}).out.find("double or single") != std::string::npos);
  const Json& choices = rk4.at("params").list.at(0).at("choices");
  REQUIRE(choices.list.size() == 2);
  CHECK(choices.list[1].text == "single");
  CHECK(rk4.at("name").text == "rk4");
  CHECK(rk4.at("order").number == 4);
  CHECK(rk4.at("evaluations").number == 4);
  const Json cloth =
      read_json(run_sim({"describe", "scenes/cloth.lua", "--set", "n=5", "--json"}).out);
  CHECK(names_of(cloth.at("args")) == std::vector<std::string>{"n", "structural", "shear", "flex"});
  CHECK(cloth.at("args").list[0].at("default").text == "8");
  CHECK(cloth.at("args").list[0].at("value").text == "5");
  CHECK(cloth.at("systems").list[0].at("particles").number == 25);
  // A list of numbers has components, and neither particles nor springs.
  const TemporaryFolder folder;
  const std::string flat = (folder.path() / "flat.lua").string();
  write_text(flat,
             "local sim = require 'sim'\nreturn sim.scene { name = 'f', state = { 1, 0, 5 },\n"
             "  field = sim.field.lua { function(t, x) return { x[2], -x[1], 0 } end },\n"
             "  integrator = 'rk4', dt = 0.1, duration = 1.5 }\n");
  const Json list = read_json(run_sim({"describe", flat, "--json"}).out).at("systems").list.at(0);
  CHECK(list.keys == std::vector<std::string>{"name", "order_of_state", "components", "switches",
                                              "integrator", "dt", "duration"});
  CHECK(list.at("order_of_state").number == 1);
  CHECK(list.at("components").number == 3);
  CHECK((list.at("dt").number == 0.1 && list.at("duration").number == 1.5));
  const Json net = cloth.at("systems").list[0];
  CHECK(net.keys == std::vector<std::string>{"name", "order_of_state", "particles", "pinned",
                                             "springs", "switches", "integrator", "dt",
                                             "duration"});
  CHECK((net.at("order_of_state").number == 2 && net.at("pinned").number == 2));
  // Structural 2 n (n - 1), shear 2 (n - 1)^2, flex 2 n (n - 2).
  CHECK(net.at("springs").number == 40 + 32 + 30);
  const Outcome text = run_sim({"describe", "scenes/cloth.lua", "--set", "n=5"});
  CHECK(text.out.find("  n           8        5      particles a side\n") != std::string::npos);
}

TEST_CASE("doctor finds what is wrong") {
  const Outcome well = run_sim({"doctor"});
  CHECK(well.code == 0);
  CHECK(well.out.find("WRONG") == std::string::npos);

  const TemporaryFolder folder;
  write_text(folder.path() / "broken.so", "no library");
  const Outcome broken = run_sim({"doctor", "--plugin-path", folder.path().string()});
  CHECK(broken.code == 5);
  CHECK(broken.out.find("WRONG  rejected") != std::string::npos);
  CHECK(broken.out.find("broken.so") != std::string::npos);
  const Outcome missing = run_sim({"doctor", "--plugin-path", "/nowhere", "--json"});
  CHECK(missing.code == 5);
  CHECK(!read_json(missing.out).at("ok").flag);
}

TEST_CASE("plugins are found in the user's home, and a name given twice stops everything") {
  const TemporaryFolder folder;
  const auto place = folder.path() / "sim/plugins/forces";
  std::filesystem::create_directories(place);
  std::filesystem::copy_file(SIM_FIXTURE_DIR "/noticed/noticed.so", place / "noticed.so");
  const ProgramOptions at_home{.environment = {{"XDG_DATA_HOME", folder.path().string()}}};
  CHECK(run_sim({"list", "forces"}, at_home).out.find("noticed") != std::string::npos);
  CHECK(run_sim({"list", "forces"}).out.find("noticed") == std::string::npos);
  std::filesystem::copy_file(SIM_FIXTURE_DIR "/duplicate/duplicate.so", place / "mine.so");
  const Outcome twice = run_sim({"-n", "1"}, at_home);
  CHECK(twice.code == 7);
  CHECK(twice.err.find("mine.so") != std::string::npos);
  CHECK(twice.err.find("forces/gravity.so") != std::string::npos);
}

TEST_CASE("scenes are found as given, then in SIM_PATH, then with the program") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "scenes");
  const std::string circle = read_text(SIM_SOURCE_DIR "/scripts/scenes/circle.lua");
  write_text(folder.path() / "scenes/cloth.lua", circle);
  const ProgramOptions with_path{.environment = {{"SIM_PATH", folder.path().string()}}};
  CHECK(run_sim({"-n", "1"}, with_path).out.rfind("scene       circle", 0) == 0);
  CHECK(run_sim({"-n", "1"}, {.folder = folder.path()}).out.rfind("scene       circle", 0) == 0);
  CHECK(run_sim({"-n", "1"}).out.rfind("scene       cloth", 0) == 0);
}

}  // namespace
}  // namespace sim_test
