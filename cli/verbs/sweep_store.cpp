#include "cli/verbs/sweep_store.h"

#include <array>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "core/base/error.h"
#include "core/output/format.h"
#include "core/output/process.h"

namespace sim::cli {
namespace {

std::string key_text(std::uint64_t key) {
  std::array<char, 20> text;
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(key));
  return text.data();
}

}  // namespace

SweepStore::SweepStore(const std::string& table)
    : folder_(std::filesystem::path(table).replace_extension(".cases")) {}

std::filesystem::path SweepStore::file_of(std::size_t index) const {
  std::array<char, 32> name;
  std::snprintf(name.data(), name.size(), "%06zu.csv", index);
  return folder_ / name.data();
}

std::string SweepStore::names() const { return (folder_ / "%06d.csv").string(); }

// Two lines: the key, and the fields.
std::optional<std::vector<std::string>> SweepStore::get(std::size_t index,
                                                        std::uint64_t key) const {
  std::ifstream in(file_of(index));
  std::string first, second;
  if (!std::getline(in, first) || first != key_text(key) || !std::getline(in, second)) return {};
  if (in.eof()) return {};  // cut off
  return csv_fields(second);
}

void SweepStore::put(std::size_t index, std::uint64_t key,
                     const std::vector<std::string>& fields) const {
  std::error_code error;
  std::filesystem::create_directory(folder_, error);
  if (error && !std::filesystem::is_directory(folder_))
    throw Error(ErrorKind::kIo, {"cannot keep the cases of a sweep", folder_.string(),
                                 error.message(), "choose another file for --out"});
  FileBeside file(file_of(index).string());
  std::ofstream out(file.temporary(), std::ios::binary);
  out << key_text(key) << '\n';
  for (std::size_t i = 0; i < fields.size(); ++i) out << (i ? "," : "") << csv_field(fields[i]);
  out << '\n';
  out.close();
  if (!out)
    throw Error(ErrorKind::kIo,
                {"cannot write", file_of(index).string(), "the disk may be full", ""});
  file.commit();
}

}  // namespace sim::cli
