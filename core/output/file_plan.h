// The files of a command in one list, checked before the first of them is opened: no input is an
// output, and no two outputs are one file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sim {

class Registry;
struct SceneSpec;

// The file that a name leads to, with all links followed, whether or not it is there yet.
std::filesystem::path resolved_file(const std::string& name);

class FilePlan {
 public:
  // `role` names the file in messages: "--snap", "the scene". Names that are no regular files, such
  // as devices, are never in conflict. "-" is standard output. In the last part of an output's
  // name, %d or %04d stands for the digits of all files of a series.
  void reads(const std::string& role, const std::string& file);
  // `beside`: other names of the same output, which may be one file with it.
  void writes(const std::string& role, const std::string& file,
              const std::vector<std::string>& beside = {});

  // Compares by device and inode, and a file that is not there yet by its folder and name. Throws
  // Error{kUsage}.
  void check() const;

 private:
  struct Entry {
    std::string role, file;
    int output = 0;  // its number; 0: it is read
  };

  std::vector<Entry> entries_;
  int outputs_ = 0;
};

// Plans the files that were read for the scene, and the libraries of plugins.
void plan_inputs(const SceneSpec& scene, const Registry& registry, FilePlan& plan);

}  // namespace sim
