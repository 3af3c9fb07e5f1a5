// Manual pages, generated from the declarations of the command lines.
#pragma once

#include <string>
#include <vector>

namespace sim::cli {

struct ManualSection {
  std::string title, text;  // the text as --help prints it
};

// The source of PROGRAM.1 for man: roff, section 1.
std::string manual_page(const std::string& program, const std::string& summary,
                        const std::vector<ManualSection>& sections);

}  // namespace sim::cli
