// The rules of the tree itself, checked over its real files: who may include whom, sizes, names.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace {

namespace fs = std::filesystem;

struct File {
  std::string path;  // from the top of the tree, with '/'
  std::vector<std::string> lines;

  std::string folder() const { return fs::path(path).parent_path().string(); }
  bool header() const { return path.ends_with(".h"); }
};

std::vector<std::string> lines_of(const fs::path& path) {
  std::ifstream in(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

// The C++ files below the folders given, sorted by path.
std::vector<File> cpp_files(const std::vector<std::string>& folders) {
  const fs::path root = SIM_SOURCE_DIR;
  std::vector<File> files;
  for (const std::string& folder : folders)
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string suffix = entry.path().extension().string();
      if (suffix == ".h" || suffix == ".cpp" || suffix == ".inc")
        files.push_back({fs::relative(entry.path(), root).string(), lines_of(entry.path())});
    }
  std::sort(files.begin(), files.end(),
            [](const File& a, const File& b) { return a.path < b.path; });
  REQUIRE(files.size() > 10);
  return files;
}

// The includes of a file: the text between the quotes or the angle brackets.
std::vector<std::string> includes_of(const File& file) {
  static const std::regex include(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  std::vector<std::string> found;
  for (const std::string& line : file.lines)
    if (std::smatch match; std::regex_search(line, match, include)) found.push_back(match[1]);
  return found;
}

// The part of the tree that a path belongs to: core/ode/x.h -> core/ode, cli/sim.cpp -> cli,
// plugins/forces/drag.cpp -> plugins/forces.
std::string part_of(const std::string& path) {
  const auto first = path.find('/');
  if (first == std::string::npos) return "";
  const std::string top = path.substr(0, first);
  if (top == "cli" || top == "tests") return top;
  const auto second = path.find('/', first + 1);
  return second == std::string::npos ? top : path.substr(0, second);
}

// The folder of a plugin that is one, plugins/forces/fluid; else empty.
std::string physics_of(const File& file) {
  const std::string folder = file.folder();
  return folder.starts_with("plugins/") && std::ranges::count(folder, '/') == 2 ? folder : "";
}

// The allowed includes of each part besides its own files. An entry is a part or one header.
const std::set<std::string> kGround = {"core/base", "core/simd", "core/math"};

std::set<std::string> ground_and(std::set<std::string> more) {
  more.insert(kGround.begin(), kGround.end());
  return more;
}

const std::set<std::string> kToScene = ground_and(
    {"core/geometry", "core/ode", "core/fields", "core/particles", "core/plugin", "core/scene"});
const std::set<std::string> kToOutput = [] {
  std::set<std::string> rooms = kToScene;
  rooms.insert({"core/session", "core/study", "core/picture", "core/output"});
  return rooms;
}();

const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"core/base", {}},
    {"core/simd", {"core/base"}},
    {"core/math", {"core/base"}},
    {"core/expression", ground_and({"core/plugin"})},
    {"core/geometry", kGround},
    {"core/linear", kGround},
    {"core/ode", kGround},
    {"core/fields", ground_and({"core/ode/ode_system.h", "core/ode/implicit/linearisation.h",
                                "core/ode/implicit/sparse_newton.h"})},
    {"core/particles", ground_and({"core/geometry", "core/linear", "core/ode/ode_system.h"})},
    {"core/plugin", ground_and({"core/geometry", "core/ode", "core/fields", "core/particles"})},
    {"core/scene", kToScene},
    {"core/session", kToScene},
    {"core/study",
     [] {
       std::set<std::string> rooms = kToScene;
       rooms.insert("core/session");
       return rooms;
     }()},
    {"core/picture", kToScene},
    {"core/output", kToOutput},
    {"core/report", kToOutput},
    {"core/engine",
     [] {
       std::set<std::string> rooms = kToOutput;
       rooms.insert("core/report");
       return rooms;
     }()},
    {"core/lua", kToOutput},
    {"core/c",
     [] {
       std::set<std::string> rooms = kToOutput;
       rooms.insert({"core/engine", "core/report", "core/lua"});
       return rooms;
     }()},
    {"plugins/contact",
     ground_and({"core/geometry", "core/linear", "core/particles", "core/plugin"})},
    {"plugins/forces",
     ground_and({"core/expression", "core/geometry", "core/particles", "core/plugin"})},
    {"plugins/fields", ground_and({"core/expression", "core/fields", "core/ode", "core/plugin"})},
    {"plugins/colliders", ground_and({"core/particles", "core/plugin"})},
    {"plugins/laws", ground_and({"core/particles", "core/plugin"})},
    {"plugins/motions", ground_and({"core/geometry", "core/plugin"})},
    {"plugins/constraints", ground_and({"core/particles", "core/plugin"})},
    {"plugins/integrators", ground_and({"core/ode", "core/plugin"})},
    {"plugins/solvers", ground_and({"core/linear", "core/ode", "core/particles", "core/plugin"})},
    {"plugins/writers", ground_and({"core/plugin", "core/picture", "core/output"})},
    {"plugins/view", ground_and({"core/plugin", "core/picture", "core/output"})},
    {"plugins/studies", kToOutput},
    {"plugins/engines",
     [] {
       std::set<std::string> rooms = kToOutput;
       rooms.insert("core/engine");
       return rooms;
     }()},
    {"cli",
     [] {
       std::set<std::string> rooms = kToOutput;
       // sim-petsc reads what its engine writes.
       rooms.insert({"core/engine", "core/lua", "core/report", "plugins/engines/petsc_files.h"});
       return rooms;
     }()},
};

// The one header that the build writes.
constexpr const char* kGenerated = "commit.h";

bool is_of_tree(const std::string& include) {
  return include.starts_with("core/") || include.starts_with("plugins/") ||
         include.starts_with("cli/") || include.starts_with("tests/");
}

}  // namespace

TEST_CASE("includes follow the layers of the tree") {
  int checked = 0;
  for (const File& file : cpp_files({"core", "plugins", "cli"})) {
    const std::string part = part_of(file.path);
    INFO(file.path);
    const auto rule = kMayInclude.find(part);
    REQUIRE(rule != kMayInclude.end());
    for (const std::string& include : includes_of(file)) {
      if (!is_of_tree(include)) continue;
      INFO("includes " << include);
      const std::string target = part_of(include);
      CHECK((target == part || rule->second.contains(target) || rule->second.contains(include)));
      ++checked;
    }
  }
  CHECK(checked > 20);
}

// The rooms of a library, as the top CMakeLists.txt says.
std::set<std::string> rooms_of(const std::string& library) {
  const std::regex list("^set\\(" + library + "_rooms (.+)\\)$");
  std::set<std::string> rooms;
  for (const std::string& line : lines_of(fs::path(SIM_SOURCE_DIR) / "CMakeLists.txt"))
    if (std::smatch match; std::regex_search(line, match, list)) {
      std::istringstream names(match[1].str());
      for (std::string name; names >> name;) rooms.insert("core/" + name);
    }
  return rooms;
}

TEST_CASE("the kernel includes nothing of the laboratory, the plugins or the programs") {
  const std::set<std::string> kernel = rooms_of("kernel"), lab = rooms_of("lab");
  std::set<std::string> all = kernel, present;
  all.insert(lab.begin(), lab.end());
  all.insert("core/c");  // the interface of both, a library of its own
  CHECK(all.size() == kernel.size() + lab.size() + 1);
  for (const auto& entry : fs::directory_iterator(fs::path(SIM_SOURCE_DIR) / "core"))
    if (entry.is_directory()) present.insert("core/" + entry.path().filename().string());
  CHECK(present == all);
  int checked = 0;
  for (const File& file : cpp_files({"core"})) {
    if (!kernel.contains(part_of(file.path))) continue;
    for (const std::string& include : includes_of(file)) {
      if (!is_of_tree(include)) continue;
      INFO(file.path << " includes " << include);
      CHECK(kernel.contains(part_of(include)));
      ++checked;
    }
  }
  CHECK(checked > 100);
}

// A physics is a plugin. Words of one in the kernel say that it knows more than interfaces; methods
// and their solvers know none, either.
TEST_CASE("the kernel and the methods name no physics") {
  const std::regex physics(R"(fluid|\bwater|\bwinds?\b|tetrahedr|finite.?element|\bfem\b|\bsph\b)"
                           R"(|(rigid|surface).?contact)",
                           std::regex::icase);
  const std::set<std::string> kernel = rooms_of("kernel");
  int lines = 0;
  for (const File& file : cpp_files({"core", "plugins/integrators", "plugins/solvers"})) {
    if (file.path.starts_with("core/") && !kernel.contains(part_of(file.path))) continue;
    for (std::size_t i = 0; i < file.lines.size(); ++i, ++lines)
      if (std::regex_search(file.lines[i], physics))
        FAIL_CHECK(file.path << ":" << i + 1 << ": " << file.lines[i]);
  }
  CHECK(lines > 10000);
}

// The headers that a list of core/ names.
std::set<std::string> headers_of(const std::string& list) {
  const std::vector<std::string> lines = lines_of(fs::path(SIM_SOURCE_DIR) / "core" / list);
  CHECK(std::ranges::is_sorted(lines));
  for (const std::string& header : lines) {
    INFO("core/" << list << " has " << header);
    CHECK(fs::is_regular_file(fs::path(SIM_SOURCE_DIR) / header));
  }
  return {lines.begin(), lines.end()};
}

// Public headers are installed, with what they include: a plugin of the parts of a scene stands
// anywhere. Plugins that work around a run are closer to the laboratory, and those of this tree
// read some of its internal headers, too.
TEST_CASE("plugins include public headers and their own folder") {
  const std::set<std::string> open = headers_of("public_headers.txt"),
                              internal = headers_of("internal_headers.txt"),
                              anywhere = {"colliders", "constraints", "contact",
                                          "forces",    "laws",        "motions"};
  CHECK(open.size() <= 65);
  std::set<std::string> used;
  int checked = 0;
  for (const File& file : cpp_files({"plugins"})) {
    const bool stands_anywhere = anywhere.contains(part_of(file.path).substr(8));
    for (const std::string& include : includes_of(file)) {
      if (!is_of_tree(include) || fs::path(include).parent_path() == file.folder()) continue;
      INFO(file.path << " includes " << include << ", which core/public_headers.txt lacks");
      CHECK((open.contains(include) || (!stands_anywhere && internal.contains(include))));
      used.insert(include);
      ++checked;
    }
  }
  CHECK(checked > 100);
  for (const std::string& header : internal) {
    INFO("core/internal_headers.txt has " << header);
    CHECK((used.contains(header) && !open.contains(header)));
  }
}

// A unit is a header and the source of the same name. The sources that make what is built upon
// their own header: the only ones that may close a circle.
const std::set<std::string> kFactories = {
    "core/ode/ode_system",             // steppers and solvers for systems of no known structure
    "core/ode/jacobian",               // by differences, for any system
    "core/particles/springs/springs",  // the energies of runs
};

TEST_CASE("systems and steppers do not include each other in a circle, but for the factories") {
  const auto unit_of = [](const std::string& path) { return path.substr(0, path.rfind('.')); };
  std::map<std::string, std::set<std::string>> includes;
  for (const File& file : cpp_files({"core/linear", "core/ode", "core/fields", "core/particles"}))
    for (const std::string& include : includes_of(file))
      if (is_of_tree(include) && unit_of(include) != unit_of(file.path) &&
          !(file.path.ends_with(".cpp") && kFactories.contains(unit_of(file.path))))
        includes[unit_of(file.path)].insert(unit_of(include));

  // Units whose includes are all done are done; what is left lies on a circle or includes one.
  std::set<std::string> left;
  for (const auto& [unit, others] : includes) left.insert(unit);
  for (bool found = true; found;) {
    found = false;
    for (auto unit = left.begin(); unit != left.end();) {
      const auto& others = includes[*unit];
      const bool done = std::ranges::none_of(
          others, [&](const std::string& other) { return left.contains(other); });
      found = found || done;
      unit = done ? left.erase(unit) : std::next(unit);
    }
  }
  for (const std::string& unit : left) FAIL_CHECK(unit << " is part of a circle, or includes one");
  CHECK(includes.size() > 50);
}

TEST_CASE("includes are written from the top of the tree and exist") {
  for (const File& file : cpp_files({"core", "plugins", "cli", "tests"})) {
    for (const std::string& line : file.lines) {
      static const std::regex quoted(R"(^\s*#\s*include\s*"([^"]+)\")");
      std::smatch match;
      if (!std::regex_search(line, match, quoted) || match[1] == kGenerated) continue;
      INFO(file.path << " includes " << match[1].str());
      // A physics stands anywhere: it includes its own files by their names, and no other plugin.
      const std::string own = physics_of(file);
      const bool bare = match[1].str().find('/') == std::string::npos;
      CHECK_FALSE((!own.empty() && match[1].str().starts_with("plugins/")));
      CHECK(fs::is_regular_file(fs::path(SIM_SOURCE_DIR) / (bare ? own : "") / match[1].str()));
    }
  }
}

TEST_CASE("foreign libraries stay where they belong") {
  const std::regex lua(R"(^(lua[^/]*/)?(lua|lualib|lauxlib|luaconf)\.(h|hpp)$)");
  const std::regex cli11(R"(^CLI/|^CLI11)");
  for (const File& file : cpp_files({"core", "plugins", "cli"}))
    for (const std::string& include : includes_of(file)) {
      INFO(file.path << " includes " << include);
      if (std::regex_search(include, lua)) CHECK(part_of(file.path) == "core/lua");
      if (std::regex_search(include, cli11)) CHECK(part_of(file.path) == "cli");
    }
}

TEST_CASE("the top level holds what it should and nothing else") {
  const std::set<std::string> allowed = {"CHANGELOG.md",
                                         "CITATION.cff",
                                         "CMakeLists.txt",
                                         "CMakePresets.json",
                                         "CODE_OF_CONDUCT.md",
                                         "CONTRIBUTING.md",
                                         "LICENSE",
                                         "README.md",
                                         "SECURITY.md",
                                         "build",
                                         "cli",
                                         "core",
                                         "dev",
                                         "docs",
                                         "packaging",
                                         "plugins",
                                         "python",
                                         "scripts",
                                         "tests"};
  for (const auto& entry : fs::directory_iterator(SIM_SOURCE_DIR)) {
    const std::string name = entry.path().filename().string();
    INFO(name);
    CHECK((name.starts_with('.') || name.starts_with("build") || allowed.contains(name)));
  }
}

TEST_CASE("lines are short and hold no tabs") {
  for (const File& file : cpp_files({"core", "plugins", "cli", "tests"}))
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string& line = file.lines[i];
      // Bytes that continue a UTF-8 character take no column.
      const auto columns =
          std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
      if (columns <= 100 && line.find('\t') == std::string::npos && !line.ends_with(' ')) continue;
      FAIL_CHECK(file.path << ":" << i + 1
                           << ": too long, or with a tab or trailing space: " << line);
    }
}

TEST_CASE("files are short and headers begin with their purpose") {
  for (const File& file : cpp_files({"core", "plugins", "cli", "tests"})) {
    INFO(file.path << " has " << file.lines.size() << " lines");
    // Kernels that sources share are read once an instruction set; they are no interfaces.
    const bool kernel = file.path == "core/simd/foreach_target.h" ||
                        std::ranges::find(file.lines, "SIM_TARGET_BEGIN") != file.lines.end();
    const bool interface = file.header() && !kernel && !file.path.starts_with("tests/") &&
                           file.path != "core/c/sim.h";  // all of the interface, in one file
    CHECK(file.lines.size() <= (interface ? 130u : 600u));
    if (!file.header() || file.path == "core/c/sim.h") continue;  // that one is C
    REQUIRE_FALSE(file.lines.empty());
    CHECK(file.lines.front().starts_with("// "));
    const bool once = std::ranges::find(file.lines, "#pragma once") != file.lines.end();
    CHECK(once != kernel);
    for (const std::string& line : file.lines)
      CHECK_FALSE(std::regex_search(line, std::regex(R"(^\s*using namespace )")));
  }
}

// The files of a room are one unit of the compiler: a constant of one file would silently stand for
// that of a header in all files behind it.
TEST_CASE("constants of files hide none of their room's headers") {
  const std::regex constant(R"(^(?:inline |static )?constexpr .*?\b(k[A-Z]\w*)\b)");
  const auto room = [](const File& file) {
    if (const std::string own = physics_of(file); !own.empty()) return own;
    return file.path.substr(0, file.path.find('/', file.path.find('/') + 1));
  };
  const std::vector<File> files = cpp_files({"core", "cli", "plugins"});
  std::map<std::pair<std::string, std::string>, std::string> of_headers;  // room and name: header
  const auto each_constant = [&](const File& file, const auto& visit) {
    for (const std::string& line : file.lines)
      if (std::smatch match; std::regex_search(line, match, constant))
        visit(std::pair{room(file), match[1].str()});
  };
  for (const File& file : files)
    if (file.header()) each_constant(file, [&](const auto& name) { of_headers[name] = file.path; });
  REQUIRE(of_headers.size() > 10);
  for (const File& file : files) {
    if (file.header() || file.path.ends_with("_kernel.cpp")) continue;
    each_constant(file, [&](const auto& name) {
      const auto hidden = of_headers.find(name);
      if (hidden == of_headers.end()) return;
      FAIL_CHECK(file.path << ": " << name.second << " is a constant of " << hidden->second);
    });
  }
}

TEST_CASE("a file that is compiled once an instruction set says so in its name") {
  int kernels = 0;
  for (const File& file : cpp_files({"core", "plugins"})) {
    if (file.header()) continue;
    INFO(file.path);
    const auto includes = includes_of(file);
    const bool several =
        std::ranges::find(includes, "core/simd/foreach_target.h") != includes.end();
    CHECK(several == file.path.ends_with("_kernel.cpp"));
    if (!several) continue;
    ++kernels;
    const std::string own = physics_of(file);
    const std::string name = own.empty() ? file.path : file.path.substr(own.size() + 1);
    CHECK(std::ranges::find(file.lines, "#define SIM_THIS_FILE \"" + name + "\"") !=
          file.lines.end());
  }
  CHECK(kernels >= 6);
}

TEST_CASE("every plugin, a file or a folder, has its line in CMakeLists.txt") {
  std::set<std::string> named;
  for (const std::string& line : lines_of(fs::path(SIM_SOURCE_DIR) / "CMakeLists.txt"))
    if (std::smatch match;
        std::regex_search(line, match, std::regex(R"(^\s*sim_plugin\((.+)\))"))) {
      std::istringstream files(match[1].str());
      for (std::string file; files >> file;) named.insert("plugins/" + file);
    }
  std::set<std::string> present;
  for (const File& file : cpp_files({"plugins", "core"}))
    if (file.path.starts_with("plugins/") && file.path.ends_with(".cpp"))
      present.insert(physics_of(file).empty() ? file.path : physics_of(file));
  CHECK(named == present);
  CHECK(named.size() >= 8);
}

// A comment begins with its subject. A relative clause or a genitive without a noun is a riddle.
TEST_CASE("sentences of comments begin with their subject") {
  static const std::regex riddle(R"((^|[.:?!] )(Of|What|Those|As|Likewise) )");
  int sentences = 0;
  for (const File& file : cpp_files({"core", "plugins", "cli", "tests"})) {
    if (file.path.ends_with(".inc")) continue;  // of other languages
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string& line = file.lines[i];
      const std::size_t at = line.find("// ");
      if (at == std::string::npos || line.substr(0, at).find('"') != std::string::npos) continue;
      const std::string text = line.substr(at + 3);
      sentences += text.empty() ? 0 : 1;
      if (std::regex_search(text, riddle))
        FAIL_CHECK(file.path << ":" << i + 1 << ": begins without its subject: " << text);
    }
  }
  CHECK(sentences > 10000);
}
