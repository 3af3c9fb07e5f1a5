// One plugin library: its card, read from the file, and its code, opened on demand.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/plugin/plugin.h"

namespace sim {

// The card of the library, read as plain data from the section .sim_plugin of the ELF file: no code
// of the library runs. Throws Error{kPlugin} naming the file if it is no library, has no card, or
// was made for another ABI.
PluginCard read_card(const std::filesystem::path& file);

// The card, if it fits this kernel; throws likewise. `file` is its location.
PluginCard checked_card(PluginCard card, const std::filesystem::path& file);

// The plugins that a card names, each with its aliases.
struct CardName {
  std::string name;
  std::vector<std::string> aliases;
};
std::vector<CardName> card_names(const PluginCard& card);

// The state of a file by the checksum that sim_add_plugin appends.
enum class Seal { kNone, kWhole, kBroken };
Seal check_seal(const std::filesystem::path& file);

// Lets plugins register. Throws Error{kPlugin} for any exception of theirs.
void enroll_plugins(const std::filesystem::path& file, void (*enroll)(Registrar&),
                    Registrar& registrar);

// Opens the library and lets it register; returns content_hash() of the file. The library stays
// open for the life of the process, for objects of its classes may outlive any owner. Throws
// Error{kPlugin}, before any of its code runs if its seal is broken.
std::uint64_t open_library(const std::filesystem::path& file, Registrar& registrar);

}  // namespace sim
