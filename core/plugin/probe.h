// Probes a plugin library in a process of its own, which it may crash.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace sim {

// The outcome of `work` in a child process: "" if it returned, else "it crashes: signal 11
// (Segmentation fault)" or "it does not end in 10 s". An exception counts as a return, and its
// output is lost.
std::string tried_by_child(const std::function<void()>& work, double seconds = 10);

// Opens the library in a child, lets it register, and makes one of each plugin that needs no more
// than its defaults. Throws Error{kPlugin} with its name if that ends the child.
void probe_library(const std::filesystem::path& file);

}  // namespace sim
