#include "cli/run/language_docs.h"

#include <fstream>
#include <string_view>
#include <vector>

namespace sim::cli {

std::map<std::string, std::string> language_docs(const Environment& environment) {
  std::map<std::string, std::string> docs;
  for (const auto& folder : environment.scene_folders) {
    std::ifstream file(folder / "sim" / "init.lua");
    if (!file) continue;
    std::vector<std::string> names;
    std::string text;
    const auto close = [&] {
      for (const std::string& name : names) docs.emplace(name, text);
      names.clear();
      text.clear();
    };
    for (std::string line; std::getline(file, line);) {
      if (!line.starts_with("-- ")) {
        if (line != "--") close();
        if (line == "--") text += "\n";
        continue;
      }
      line.erase(0, 3);
      // A heading has the call at its front or after "NAME = ", and starts at the margin.
      const std::size_t call = line.find_first_of("({");
      const std::size_t before = line.find_last_of(".:", call);
      if (line[0] != ' ' && call != std::string::npos && before != std::string::npos &&
          line.find_first_of(" ,", before) >= (line[call - 1] == ' ' ? call - 1 : call)) {
        std::string name = line.substr(before + 1, call - before - 1);
        while (name.ends_with(' ')) name.pop_back();
        const std::string_view head = std::string_view(line).substr(0, before + 1);
        if (!name.empty() && (head.ends_with("sim.") || head.ends_with(':'))) names.push_back(name);
      }
      text += line + "\n";
    }
    close();
    break;
  }
  return docs;
}

}  // namespace sim::cli
