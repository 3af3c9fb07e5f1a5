// The arguments of a study: "NAME=VALUE" texts.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace sim::c {

// Each is taken once, and none may be left over.
class AskedWords {
 public:
  // Throws Error{kUsage} for a text that is not NAME=VALUE. Null: none; else a null pointer ends
  // them.
  explicit AskedWords(const char* const* texts);

  // Throws Error{kUsage} if the name occurs twice. "" if it is missing.
  std::string text(const std::string& name);
  std::optional<double> number(const std::string& name);   // at least 0, or Error{kUsage}
  bool flag(const std::string& name, bool usual);          // 0 or 1, or Error{kUsage}
  std::vector<std::string> all(const std::string& name);   // of this name, in their order
  std::vector<std::string> list(const std::string& name);  // between commas
  std::map<std::string, std::string> rest();               // each once
  // Throws Error{kUsage} for unused arguments.
  void finish(const std::string& study) const;

 private:
  std::multimap<std::string, std::string> words_;
};

}  // namespace sim::c
