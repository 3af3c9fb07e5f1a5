#include "cli/verbs/sweep_store.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "core/base/error.h"
#include "core/base/md5.h"
#include "core/output/format.h"
#include "core/output/output.h"

namespace sim::cli {
namespace {

std::string key_text(std::uint64_t key) {
  std::array<char, 20> text;
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(key));
  return text.data();
}

bool parse_key(const std::string& text, std::uint64_t& key) {
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, key, 16);
  return error == std::errc() && rest == end;
}

std::string csv_line(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : ",") + csv_field(word);
  return line + '\n';
}

std::string sum_line(std::string_view text) { return csv_line({"md5", md5(text)}); }

constexpr std::size_t kSumLine = 4 + 32 + 1;  // bytes of it
constexpr const char *kKey = "key", *kFile = "file", *kRow = "row";

}  // namespace

SweepStore::SweepStore(const std::string& table)
    : folder_(std::filesystem::path(table).replace_extension(".cases")) {}

std::filesystem::path SweepStore::file_of(std::size_t index) const {
  std::array<char, 32> name;
  std::snprintf(name.data(), name.size(), "%06zu.csv", index);
  return folder_ / name.data();
}

std::string SweepStore::names() const { return (folder_ / "%06d.csv").string(); }

// Lines of words between commas, the first of which says what the line is; the last one is the
// checksum of all before it.
StoredCase SweepStore::get(std::size_t index, std::uint64_t key) const {
  std::ifstream in(file_of(index), std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(in), {});
  if (!in.is_open()) return {};
  const StoredCase damaged{StoredCase::State::kDamaged};
  const std::size_t size = text.size() - std::min(text.size(), kSumLine);
  const std::string_view body = std::string_view(text).substr(0, size);
  if (text.substr(size) != sum_line(body)) return damaged;
  StoredCase kept{StoredCase::State::kWhole};
  std::istringstream lines{std::string(body)};
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> words = csv_fields(line);
    const std::string what = words.front();
    words.erase(words.begin());
    if (what == kKey && words != std::vector{key_text(key)}) return {};
    if (what == kFile) {
      InputFile& input = kept.result.inputs.emplace_back();
      if (words.size() != 3 || !parse_key(words[2], input.hash)) return damaged;
      input.name = words[0];
      input.path = words[1];
    } else if (what == kRow) {
      kept.result.fields = std::move(words);
    }
  }
  return kept;
}

void SweepStore::put(std::size_t index, std::uint64_t key, const CaseResult& result) const {
  std::error_code error;
  std::filesystem::create_directory(folder_, error);
  if (error && !std::filesystem::is_directory(folder_))
    throw Error(ErrorKind::kIo, {"cannot keep the cases of a sweep", folder_.string(),
                                 error.message(), "choose another file for --out"});
  std::string text = csv_line({kKey, key_text(key)});
  for (const InputFile& input : result.inputs)
    text += csv_line({kFile, input.name, input.path, key_text(input.hash)});
  std::vector<std::string> row = result.fields;
  row.insert(row.begin(), kRow);
  text += csv_line(row);
  text += sum_line(text);
  Output file(file_of(index).string());
  file.buffer() = std::move(text);
  file.commit();
}

}  // namespace sim::cli
