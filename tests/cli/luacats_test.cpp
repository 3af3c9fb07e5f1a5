// The types of the scene language for editors: complete, and what the scenes here write.
#include <catch2/catch.hpp>
#include <filesystem>
#include <map>
#include <regex>
#include <set>

#include "core/plugin/registry.h"
#include "tests/cli/program.h"
#include "tests/support/scenes.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

namespace fs = std::filesystem;

struct Class {
  bool exact = false, numbers = false;  // no other keys; numbers of any name
  std::map<std::string, std::string> fields;
};

// The content of the annotations: classes, and the class that each function takes.
struct Types {
  std::map<std::string, Class> classes;
  std::map<std::string, std::string> options;  // "sim.grid" -> "sim.GridOptions"
  std::set<std::string> functions;
};

Types read_types(const std::string& text) {
  Types types;
  std::string current, options;
  std::istringstream lines(text);
  std::smatch found;
  static const std::regex kClass(R"(---@class (\(exact\) )?([\w.]+).*)"),
      kField(R"(---@field (\w+|\[1\]|\[2\]|\[3\]|\[string\])\??\s+(.*))"),
      kParam(R"(---@param (?:options|entries)\?? ([\w.]+).*)"),
      kOverload(R"(---@overload fun\(options: ([\w.]+)\).*)"),
      kFunction(R"(function ([\w.:]+)\(.*)");
  for (std::string line; std::getline(lines, line);) {
    if (std::regex_match(line, found, kClass)) {
      current = found[2];
      types.classes[current].exact = found[1].matched;
    } else if (std::regex_match(line, found, kField)) {
      if (found[1] == "[string]")
        types.classes[current].numbers = true;
      else
        types.classes[current].fields[found[1]] = found[2];
    } else if (std::regex_match(line, found, kParam)) {
      options = found[1];
    } else if (std::regex_match(line, found, kOverload)) {
      types.options[current] = found[1];
    } else if (std::regex_match(line, found, kFunction)) {
      types.functions.insert(found[1]);
      if (!options.empty()) types.options[found[1]] = options;
      options.clear();
    }
  }
  return types;
}

std::vector<std::string> tokens_of(const std::string& lua) {
  static const std::regex kToken(
      R"(--[^\n]*|"(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*'|\d[\w.]*|\w+|==|\.\.|[^\s])");
  std::vector<std::string> tokens;
  for (std::sregex_iterator it(lua.begin(), lua.end(), kToken), end; it != end; ++it)
    if (!it->str().starts_with("--")) tokens.push_back(it->str());
  return tokens;
}

// The reason why a literal is not of a type; empty if it may be, or is no literal.
bool may_be(const std::string& value, const std::string& next, const std::string& type) {
  const bool literal = next == "," || next == "}" || next == ";";
  const auto has = [&](const char* word) { return type.find(word) != std::string::npos; };
  if (!literal) return true;
  if (std::isdigit(static_cast<unsigned char>(value[0])))
    return has("number") || has("integer") || has("1|2");
  if (value[0] == '"') return has("string") || has(value.c_str());
  if (value == "true" || value == "false") return has("boolean");
  return true;
}

// The keys and literals of every `sim.NAME { ... }` and `sim.KIND.NAME { ... }` of a scene, each as
// "what: why" if the types do not know it. `calls` counts what was looked at.
std::vector<std::string> mistakes(const std::string& lua, const Types& types, int& calls) {
  const std::vector<std::string> tokens = tokens_of(lua);
  std::vector<std::string> found;
  for (std::size_t i = 0; i + 3 < tokens.size(); ++i) {
    if (tokens[i] != "sim" || tokens[i + 1] != ".") continue;
    std::string name = "sim." + tokens[i + 2];
    std::size_t at = i + 3;
    if (tokens[at] == "." && at + 1 < tokens.size()) name += "." + tokens[at + 1], at += 2;
    if (at < tokens.size() && tokens[at] == "(") ++at;
    if (at >= tokens.size() || tokens[at] != "{") continue;
    const auto options = types.options.find(name);
    if (options == types.options.end()) {
      const bool takes_list = name == "sim.world" || name == "sim.compound";
      if (!takes_list) found.push_back(name + ": no such function");
      continue;
    }
    ++calls;
    const Class& known = types.classes.at(options->second);
    int depth = 0, functions = 0;
    for (std::size_t k = at; k < tokens.size(); ++k) {
      const std::string& token = tokens[k];
      if (token == "{" || token == "(" || token == "[") ++depth;
      if (token == "}" || token == ")" || token == "]") --depth;
      if (token == "function" || token == "if" || token == "do") ++functions;
      if (token == "end") --functions;
      if (depth == 0) break;
      if (depth != 1 || functions != 0 || tokens[k + 1] != "=" ||
          !(tokens[k - 1] == "{" || tokens[k - 1] == "," || tokens[k - 1] == ";"))
        continue;
      const auto field = known.fields.find(token);
      if (field == known.fields.end()) {
        if (!known.numbers) found.push_back(name + ": unknown key " + token);
      } else if (!may_be(tokens[k + 2], tokens[k + 3], field->second)) {
        found.push_back(name + ": " + token + " is no " + field->second);
      }
    }
  }
  return found;
}

std::string annotations() {
  const Outcome listed = run_sim({"list", "--luacats"});
  CHECK(listed.code == 0);
  CHECK(listed.err == "");
  return listed.out;
}

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("every function of the scene language has its types") {
  const std::string text = annotations();
  const Types types = read_types(text);
  CHECK(text.find("@return any") == std::string::npos);
  CHECK(text.find("? any ") == std::string::npos);
  // Documented functions are those of comments in the language's own file.
  const std::string language = text_of(fs::path(SIM_SOURCE_DIR) / "scripts/sim/init.lua");
  static const std::regex kMade(R"(make_(\w+)\(options\))"), kMethod(R"(function (\w+:\w+)\()");
  int made = 0, methods = 0;
  for (std::sregex_iterator it(language.begin(), language.end(), kMade), end; it != end;
       ++it, ++made)
    CHECK(types.functions.count("sim." + (*it)[1].str()) == 1);
  for (std::sregex_iterator it(language.begin(), language.end(), kMethod), end; it != end; ++it) {
    const std::string name = (*it)[1];
    if (name == "Particles:lead") continue;  // an old name
    ++methods;
    const std::string method = name == "Particles:id" ? "Grid:id"
                               : name == "Force:tie"  ? "Tied:tie"
                                                      : name;
    CAPTURE(method);
    CHECK(types.functions.count(method) == 1);
  }
  CHECK(made >= 9);
  CHECK(methods >= 6);
  CHECK(types.classes.at("sim.force.spring").exact);
  CHECK(types.classes.at("sim.force.expression").numbers);
  CHECK(types.classes.at("sim.SceneOptions").fields.at("bodies") == "sim.Rigid[]");
}

// "meaning, in unit, default value", of which unit and value may be missing.
TEST_CASE("types say what each parameter means, its unit and its default") {
  const Types types = read_types(annotations());
  sim::Registry registry = make_registry();
  std::size_t params = 0, without = 0;
  for (const sim::PluginKind& kind : sim::kPluginKinds)
    for (const std::string& name : registry.names(kind)) {
      if (!kind.in_scenes) continue;
      const std::string title = "sim." + std::string(kind.name) + "." + name;
      REQUIRE(types.classes.count(title) == 1);
      for (const sim::Param& param : registry.get(kind, name).params) {
        INFO(title << ", " << param.name);
        const std::string value = sim::to_text(param.default_value);
        const std::string words = param.doc + (param.unit.empty() ? "" : ", in " + param.unit) +
                                  (value.empty() ? "" : ", default " + value);
        const std::string& field = types.classes.at(title).fields.at(param.name);
        CHECK(field.substr(field.size() - std::min(field.size(), words.size() + 1)) == " " + words);
        ++params;
        without += value.empty();
      }
    }
  CHECK(params > 150);
  CHECK((without > 20 && without < params - 20));
}

TEST_CASE("scenes write what the types know") {
  const Types types = read_types(annotations());
  int calls = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(SIM_SOURCE_DIR) / "scripts/scenes")) {
    if (entry.path().extension() != ".lua") continue;
    CAPTURE(entry.path().filename().string());
    CHECK(mistakes(text_of(entry.path()), types, calls) == std::vector<std::string>{});
  }
  CHECK(calls > 150);
}

TEST_CASE("misspelt keys and wrong types are seen") {
  const Types types = read_types(annotations());
  int calls = 0;
  const auto found = [&](const std::string& lua) { return mistakes(lua, types, calls); };
  CHECK(found("sim.force.spring { stifness = 1 }") ==
        std::vector<std::string>{"sim.force.spring: unknown key stifness"});
  CHECK(found("sim.force.spring { stiffness = \"soft\" }").size() == 1);
  CHECK(found("sim.rigid { shape = s, touches = 1 }").size() == 1);
  CHECK(found("sim.scene { body = {} }").size() == 1);
  CHECK(found("sim.force.sprong { }").size() == 1);
  CHECK(found("sim.scene { bodies = { sim.rigid { mass = 1 } }, dt = 0.1 }").empty());
}

TEST_CASE("a first scene runs, and its settings name the types") {
  const TemporaryFolder folder;
  const Outcome made = run_sim({"scene", "new", "my_net"}, {.folder = folder.path()});
  CHECK(made.code == 0);
  CHECK(made.err == "");
  const Outcome run = run_sim({"my_net/my_net.lua"}, {.folder = folder.path()});
  CHECK(run.code == 0);
  CHECK(run.out.find("trusted: ") != std::string::npos);
  const std::string settings = text_of(folder.path() / "my_net/.luarc.json");
  const fs::path types = fs::path(SIM_BINARY).parent_path().parent_path() / "lib/sim/luacats";
  CHECK(settings.find('"' + types.string() + '"') != std::string::npos);
  int calls = 0;
  CHECK(mistakes(text_of(folder.path() / "my_net/my_net.lua"), read_types(annotations()), calls) ==
        std::vector<std::string>{});
  CHECK(calls == 5);

  const std::string before = text_of(folder.path() / "my_net/my_net.lua");
  const Outcome again = run_sim({"scene", "new", "my_net"}, {.folder = folder.path()});
  CHECK(again.code == 5);
  CHECK(text_of(folder.path() / "my_net/my_net.lua") == before);
  for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
           {"scene"}, {"scene", "new"}, {"scene", "new", "../net"}, {"scene", "old", "net"}})
    CHECK(run_sim(wrong, {.folder = folder.path()}).code == 2);
}
