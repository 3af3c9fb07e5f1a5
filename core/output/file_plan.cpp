#include "core/output/file_plan.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <optional>

#include "core/base/error.h"
#include "core/plugin/registry.h"
#include "core/scene/scene_spec.h"

namespace sim {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLinks = 40;  // the system's own limit

// A file that is there, or the folder that will have it and its name below that.
struct Identity {
  dev_t device = 0;
  ino_t inode = 0;
  std::string name = {};

  auto operator<=>(const Identity&) const = default;
};

bool is_device(const struct stat& status) {
  return S_ISCHR(status.st_mode) || S_ISBLK(status.st_mode);
}

Identity identity_of(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) == 0) return {status.st_dev, status.st_ino};
  if (!file.has_relative_path()) return {0, 0, file.string()};
  Identity found = identity_of(file.parent_path());
  found.name += "/" + file.filename().string();
  return found;
}

bool all_digits(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

// A name with a number in it, as "frame-%04d.png".
struct Series {
  std::string before, after;

  static std::optional<Series> of(const std::string& name) {
    const std::size_t begin = name.find('%'), end = name.find('d', begin);
    if (begin == std::string::npos || end == std::string::npos ||
        !all_digits(std::string_view(name).substr(begin + 1, end - begin - 1)))
      return {};
    return Series{name.substr(0, begin), name.substr(end + 1)};
  }

  bool has(std::string_view name) const {
    const std::size_t ends = before.size() + after.size();
    return name.size() > ends && name.starts_with(before) && name.ends_with(after) &&
           all_digits(name.substr(before.size(), name.size() - ends));
  }

  // May a file be of both? Then one name begins and ends as the other, but for digits.
  bool meets(const Series& other) const {
    const auto extends = [](std::string_view a, std::string_view b, bool at_end) {
      if (a.size() < b.size()) std::swap(a, b);
      const std::size_t more = a.size() - b.size();
      return at_end ? a.ends_with(b) && all_digits(a.substr(0, more))
                    : a.starts_with(b) && all_digits(a.substr(b.size()));
    };
    return extends(before, other.before, false) && extends(after, other.after, true);
  }
};

// A name of the plan with the files that it stands for.
struct Planned {
  std::string role, file;
  int output = 0;                    // 0: it is read
  std::vector<Identity> files = {};  // existing files of a series
  std::optional<Series> series = {};
  Identity folder = {};  // with `name`: where a series may have it
  std::string name = {};
};

constexpr std::string_view kStandardOutput = "-";

// Nothing for a device. Standard output is a file of its own, unless it was led into one.
std::optional<Planned> planned(const std::string& role, const std::string& file, int output) {
  Planned plan{role, file, output};
  struct stat status {};
  if (file == kStandardOutput) {
    if (::fstat(STDOUT_FILENO, &status) == 0 && S_ISREG(status.st_mode))
      plan.files.push_back({status.st_dev, status.st_ino});
    plan.files.push_back({0, 0, file});
    return plan;
  }
  if (::stat(file.c_str(), &status) == 0 && is_device(status)) return {};
  const fs::path resolved = resolved_file(file);
  plan.files.push_back(identity_of(resolved));
  plan.folder = identity_of(resolved.parent_path());
  plan.name = resolved.filename().string();
  if (output > 0) plan.series = Series::of(plan.name);
  std::error_code failed;
  fs::directory_iterator entry, end;
  if (plan.series) entry = fs::directory_iterator(resolved.parent_path(), failed);
  for (; !failed && entry != end; entry.increment(failed))
    if (plan.series->has(entry->path().filename().string()))
      plan.files.push_back(identity_of(resolved_file(entry->path().string())));
  return plan;
}

bool in_conflict(const Planned& a, const Planned& b) {
  for (const Identity& one : a.files)
    if (std::ranges::find(b.files, one) != b.files.end()) return true;
  if (a.series && b.series) return a.folder == b.folder && a.series->meets(*b.series);
  const Planned &many = a.series ? a : b, &single = a.series ? b : a;
  return many.series && many.folder == single.folder && many.series->has(single.name);
}

std::string shown(const Planned& plan) {
  return plan.file == kStandardOutput ? "standard output" : plan.file;
}

[[noreturn]] void refuse(const Planned& one, const Planned& other) {
  if (one.output == 0 || other.output == 0) {
    const Planned &output = one.output > 0 ? one : other, &input = one.output > 0 ? other : one;
    throw Error(ErrorKind::kUsage,
                {"an output would replace an input", output.role + " " + shown(output),
                 "it is " + input.role + " " + shown(input) + ", which is read",
                 "give " + output.role + " another file"});
  }
  throw Error(ErrorKind::kUsage,
              {"two outputs for one file", one.role + " and " + other.role,
               "both would be written to " + shown(one), "give one of them another file"});
}

}  // namespace

fs::path resolved_file(const std::string& name) {
  std::error_code failed;
  fs::path path = fs::absolute(name, failed);
  for (int links = 0; links < kMostLinks; ++links) {
    if (const fs::path whole = fs::weakly_canonical(path, failed); !failed) path = whole;
    // A link that leads to no file yet is left by that.
    const fs::path target = fs::read_symlink(path, failed);
    if (failed) break;
    path = path.parent_path() / target;
  }
  return path;
}

void FilePlan::reads(const std::string& role, const std::string& file) {
  entries_.push_back({role, file});
}

void FilePlan::writes(const std::string& role, const std::string& file,
                      const std::vector<std::string>& beside) {
  entries_.push_back({role, file, ++outputs_});
  for (const std::string& name : beside) entries_.push_back({role, name, outputs_});
}

void FilePlan::check() const {
  std::vector<Planned> plans;
  for (const Entry& entry : entries_)
    if (auto plan = planned(entry.role, entry.file, entry.output))
      plans.push_back(std::move(*plan));
  // Words go to standard output where no table does.
  if (std::ranges::find(plans, kStandardOutput, &Planned::file) == plans.end())
    plans.push_back(*planned("the report", std::string(kStandardOutput), outputs_ + 1));
  for (std::size_t i = 0; i < plans.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (plans[i].output != plans[j].output && in_conflict(plans[j], plans[i]))
        refuse(plans[j], plans[i]);
}

void plan_inputs(const SceneSpec& scene, const Registry& registry, FilePlan& plan) {
  for (const InputFile& file : scene.inputs)
    if (file.hash != 0) plan.reads(file.name == "scene" ? "the scene" : "the module", file.path);
  for (const auto& library : registry.libraries()) plan.reads("the plugin", library.string());
}

}  // namespace sim
