#include "cli/command_line/manual_page.h"

#include <sstream>

#include "cli/run/environment.h"

namespace sim::cli {
namespace {

// Escapes lines for roff, to which a backslash, a hyphen and a point at the front are special.
std::string verbatim(const std::string& text) {
  std::istringstream lines(text);
  std::string result;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('.') || line.starts_with('\'')) result += "\\&";
    for (const char c : line) {
      if (c == '\\')
        result += "\\e";
      else if (c == '-')
        result += "\\-";
      else
        result += c;
    }
    result += '\n';
  }
  return result;
}

}  // namespace

std::string manual_page(const std::string& program, const std::string& summary,
                        const std::vector<ManualSection>& sections) {
  std::string page = ".TH " + program + " 1 \"\" \"sim " + build_facts().version +
                     "\"\n.SH NAME\n" + program + " \\- " + verbatim(summary);
  for (const ManualSection& section : sections)
    page += ".SH \"" + section.title + "\"\n.nf\n" + verbatim(section.text) + ".fi\n";
  return page;
}

}  // namespace sim::cli
