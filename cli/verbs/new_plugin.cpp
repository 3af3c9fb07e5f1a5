#include "cli/verbs/new_plugin.h"

#include <algorithm>
#include <cctype>
#include <vector>

#include "cli/run/environment.h"
#include "cli/verbs/new_folder.h"
#include "cli/verbs/plugin_templates.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/output.h"

namespace sim::cli {
namespace {

std::string replaced(std::string text, const std::string& word, const std::string& with) {
  for (std::size_t at = text.find(word); at != std::string::npos;
       at = text.find(word, at + with.size()))
    text.replace(at, word.size(), with);
  return text;
}

// "my_wind" -> "MyWind".
std::string class_name(const std::string& name) {
  std::string result;
  bool up = true;
  for (const char c : name) {
    if (c != '_') result += up ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
    up = c == '_';
  }
  return result;
}

// The options that g++ needs here besides the files; a folder that is written keeps none of their
// paths.
std::string compiler_flags() {
  const DevelopmentFiles files = development_files();
  return "-std=c++20 -O2 -ffp-contract=off -shared -fPIC -I " + files.headers.string() + " -L " +
         files.libraries.string() + " -Wl,--as-needed -lsimlab -lsimkernel";
}

// The command that builds a library from one file without CMake.
std::string compiler_line(const std::string& name) {
  return "g++ " + name + ".cpp -o " + name + ".so $(sim plugin flags)";
}

std::string cmake_file(const std::string& name) {
  return "cmake_minimum_required(VERSION 3.25)\n"
         "project(" +
         name +
         " LANGUAGES CXX)\n"
         "find_package(sim REQUIRED)\n"
         "sim_add_plugin(" +
         name + " " + name +
         ".cpp)\n"
         "# Beside the scene that names it.\n"
         "set_target_properties(" +
         name +
         " PROPERTIES\n"
         "  LIBRARY_OUTPUT_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})\n";
}

}  // namespace

bool legal_folder_name(const std::string& name) {
  const auto lower = [](char c) { return (c >= 'a' && c <= 'z') || c == '_'; };
  return !name.empty() && name.size() <= 40 && name[0] >= 'a' && name[0] <= 'z' &&
         std::ranges::all_of(name, [&](char c) { return lower(c) || (c >= '0' && c <= '9'); });
}

int new_plugin(const NewPluginRequest& request, Console& console) {
  if (request.flags) {
    put(console.out, compiler_flags() + "\n");
    flush_or_throw(console.out, "standard output");
    return 0;
  }
  std::vector<std::string> kinds;
  for (const PluginTemplate& each : plugin_templates()) kinds.emplace_back(each.kind);
  const auto chosen = std::ranges::find(kinds, request.kind);
  if (chosen == kinds.end())
    throw Error(ErrorKind::kUsage,
                {"no such kind", "sim plugin new " + request.kind,
                 "there is a beginning for " + join(kinds, ", "), suggestion(request.kind, kinds)});
  const std::string& name = request.name;
  if (!legal_folder_name(name))
    throw Error(ErrorKind::kUsage,
                {"bad name", "sim plugin new " + request.kind + " '" + name + "'",
                 "a name has lower case letters, digits and _", "choose one like my_wind"});
  NewFolder folder(name);
  const PluginTemplate& begin =
      plugin_templates()[static_cast<std::size_t>(chosen - kinds.begin())];
  const auto filled = [&](const char* text) {
    return replaced(replaced(text, "CLASS", class_name(name)), "NAME", name);
  };
  const std::string by_hand = compiler_line(name), run = filled(begin.run);
  folder.write(name + ".cpp", filled(begin.source));
  if (begin.scene) folder.write(name + ".lua", filled(begin.scene));
  folder.write("CMakeLists.txt", cmake_file(name));
  folder.write("README.md", "# " + name + "\n\nA plugin of the kind `" + request.kind +
                                "` for `sim`.\n\n```sh\n" +
                                "cmake -B build && cmake --build build    # or:\n" + by_hand +
                                "\n" + "sim test " + name + ".so\n" + run + "\n```\n");
  folder.keep();

  put(console.out, "wrote " + name + "/: " + name + ".cpp, CMakeLists.txt, " +
                       (begin.scene ? name + ".lua, " : "") +
                       "README.md\n\nbuild, test, run:\n  cd " + name + "\n  " + by_hand +
                       "\n  sim test " + name + ".so\n  " + run + "\n");
  flush_or_throw(console.out, "standard output");
  return 0;
}

}  // namespace sim::cli
