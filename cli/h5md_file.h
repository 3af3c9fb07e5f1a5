// Checks of H5MD files of unknown origin by their reader.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/output/hdf5.h"

namespace sim::h5md {

using Size = std::vector<hsize_t>;

struct Refused {
  std::string why;
};
[[noreturn]] void refuse(const std::string& why);

// Opens the object that a name leads to, step by step, never one in another file. The handle is not
// valid where there is none.
hdf5::Handle open(hid_t in, const std::string& path);

bool is_group(hid_t object);
bool is_dataset(hid_t object);
std::vector<std::string> names_in(hid_t group);  // the first 1000
Size size_of(hid_t space);

struct Numbers {
  std::vector<double> values;
  Size size;  // without that of the moments
  std::string unit;
  bool any() const { return !values.empty(); }
};

// All of a dataset, or its last row only.
Numbers read(hid_t set, const std::string& path, bool last);

// An element of a group of particles: fixed, or of the last moment; empty if there is none.
Numbers element(hid_t group, const std::string& name);

// Attributes; empty if missing.
std::vector<double> attribute(hid_t object, const char* name);
std::vector<std::string> texts(hid_t object, const char* name);
std::optional<std::string> text_of(hid_t object, const char* name);

}  // namespace sim::h5md
