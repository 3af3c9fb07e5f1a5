#include "core/plugin/library.h"

#include <dlfcn.h>
#include <elf.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "core/base/float_control.h"
#include "core/base/input_file.h"
#include "core/base/md5.h"
#include "core/base/system_failure.h"
#include "core/base/thrown.h"

namespace sim {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& why,
                         const std::string& remedy = {}) {
  throw Error(ErrorKind::kPlugin, {"plugin", file.string(), why, remedy});
}

// A library that the machine cannot read or open now may still be a good one.
[[noreturn]] void refuse_for_now(const std::filesystem::path& file, int error) {
  throw Error(ErrorKind::kIo,
              {"cannot open a plugin", file.string(), std::strerror(error), remedy_for(error)});
}

// Reads a plain struct at an offset of the file; false where the file ends before.
template <class T>
bool read_at(std::ifstream& in, std::uint64_t offset, T& out) {
  if (offset > static_cast<std::uint64_t>(std::numeric_limits<std::streamoff>::max())) return false;
  if (in.bad()) return false;
  in.clear();
  in.seekg(static_cast<std::streamoff>(offset));
  return static_cast<bool>(in.read(reinterpret_cast<char*>(&out), sizeof out));
}

// Finds the section of that name by the headers of a 64-bit ELF file; false if there is none.
bool find_section(std::ifstream& in, const Elf64_Ehdr& elf, const char* name, Elf64_Shdr& found) {
  Elf64_Shdr names;
  if (!read_at(in, elf.e_shoff + std::uint64_t{elf.e_shstrndx} * sizeof names, names)) return false;
  for (int i = 0; i < elf.e_shnum; ++i) {
    if (!read_at(in, elf.e_shoff + static_cast<std::uint64_t>(i) * sizeof found, found))
      return false;
    char text[16] = {};
    if (!read_at(in, names.sh_offset + found.sh_name, text)) continue;
    if (std::strncmp(text, name, sizeof text) == 0) return true;
  }
  return false;
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return std::move(text).str();
}

Seal seal_of(std::string_view all) {
  constexpr std::string_view kMark = "SIM-PLUGIN-MD5 ";
  constexpr std::size_t kLength = kMark.size() + 32 + 1;
  if (all.size() < kLength) return Seal::kNone;
  const std::string_view seal = all.substr(all.size() - kLength);
  // A file that was truncated, or extended after its seal, is broken too.
  if (!seal.starts_with(kMark)) return all.rfind(kMark) == all.npos ? Seal::kNone : Seal::kBroken;
  return md5(all.substr(0, all.size() - kLength)) == seal.substr(kMark.size(), 32) ? Seal::kWhole
                                                                                   : Seal::kBroken;
}

}  // namespace

PluginCard read_card(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) refuse(file, "there is no such file");
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in && is_machine_failure(errno)) refuse_for_now(file, errno);
  if (!in) refuse(file, "it cannot be read", "check its permissions");

  Elf64_Ehdr elf;
  if (!read_at(in, 0, elf) || std::memcmp(elf.e_ident, ELFMAG, SELFMAG) != 0 ||
      elf.e_ident[EI_CLASS] != ELFCLASS64 || elf.e_type != ET_DYN ||
      elf.e_shentsize != sizeof(Elf64_Shdr)) {
    if (in.bad()) refuse_for_now(file, EIO);
    refuse(file, "it is not a shared library of this machine", "see plugins/README.md");
  }

  Elf64_Shdr section;
  PluginCard card;
  // Some sanitizers add padding after it.
  if (!find_section(in, elf, ".sim_plugin", section) || section.sh_size < sizeof card ||
      !read_at(in, section.sh_offset, card)) {
    if (in.bad()) refuse_for_now(file, EIO);
    refuse(file, "it has no plugin card", "write SIM_PLUGIN(Kind, names) { ... } in it");
  }
  return checked_card(card, file);
}

PluginCard checked_card(PluginCard card, const std::filesystem::path& file) {
  if (card.magic != kPluginMagic) refuse(file, "its plugin card has a wrong magic number");
  card.names[sizeof card.names - 1] = 0;
  card.build[sizeof card.build - 1] = 0;

  const std::string built = " (it was built by " + std::string(card.build) + ")";
  if (card.abi != kPluginAbi)
    refuse(file,
           "it was made for plugin ABI " + std::to_string(card.abi) + ", this kernel has ABI " +
               std::to_string(kPluginAbi) + built,
           "build it again");
  for (int i = 0; i < 6; ++i)
    if (card.sizes[i] != kAbiSizes[i])
      refuse(file, "the size of an interface struct differs from the kernel's" + built,
             "build it again with the headers of this kernel");
  if (card.kind >= kPluginKinds.size())
    refuse(file, "its plugin card names an unknown kind of plugin");
  if (card_names(card).empty()) refuse(file, "its plugin card names no plugin");
  return card;
}

std::vector<CardName> card_names(const PluginCard& card) {
  std::vector<CardName> names;
  std::istringstream words{std::string(card.names)};
  for (std::string word; words >> word;) {
    std::istringstream parts{word};
    CardName entry;
    std::getline(parts, entry.name, '/');
    for (std::string alias; std::getline(parts, alias, '/');) entry.aliases.push_back(alias);
    names.push_back(std::move(entry));
  }
  return names;
}

Seal check_seal(const std::filesystem::path& file) { return seal_of(bytes_of(file)); }

void enroll_plugins(const std::filesystem::path& file, void (*enroll)(Registrar&),
                    Registrar& registrar) {
  try {
    enroll(registrar);
  } catch (...) {
    const auto why = thrown_by_others();
    refuse(file, "its registration failed" + (why ? ": " + *why : ""));
  }
}

std::uint64_t open_library(const std::filesystem::path& file, Registrar& registrar) {
  const std::string bytes = bytes_of(file);
  if (seal_of(bytes) == Seal::kBroken)
    refuse(file, "the file is damaged: its checksum is another", "build it again");
  // A library built with -ffast-math makes the whole process flush denormals when it is opened.
  const FloatControl control;
  errno = 0;
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    if (is_machine_failure(errno)) refuse_for_now(file, errno);
    const char* const reason = dlerror();
    refuse(file, reason ? reason : "it cannot be opened");
  }
  using Enroll = void (*)(Registrar&);
  const auto enroll = reinterpret_cast<Enroll>(dlsym(library, "sim_plugin_register"));
  if (!enroll) refuse(file, "it does not export sim_plugin_register", "use the macro SIM_PLUGIN");
  enroll_plugins(file, enroll, registrar);
  return content_hash(bytes);
}

}  // namespace sim
