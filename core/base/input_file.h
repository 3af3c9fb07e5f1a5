// An input file of a run, by its content.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace sim {

struct InputFile {
  std::string name;        // "scene", "module 'scenes.circle'", "force 'drag'"
  std::string path;        // absolute
  std::uint64_t hash = 0;  // of content_hash(); 0: a path that was searched where no file was

  bool operator==(const InputFile&) const = default;
};

// Protects against accidents, not against an enemy; never 0.
std::uint64_t content_hash(std::string_view bytes);

// The same of a regular file as it is now; 0 if there is none that can be read.
std::uint64_t content_hash_of(const std::filesystem::path& file);

}  // namespace sim
