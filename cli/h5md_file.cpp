#include "cli/h5md_file.h"

#include <algorithm>

namespace sim::h5md {

using hdf5::Handle;

namespace {

constexpr hsize_t kMostNumbers = 200'000'000;
constexpr std::size_t kLongestText = 10'000;

bool holds_numbers(hid_t type) {
  const H5T_class_t kind = H5Tget_class(type);
  return kind == H5T_INTEGER || kind == H5T_FLOAT || kind == H5T_ENUM;
}

}  // namespace

void refuse(const std::string& why) { throw Refused{why}; }

Handle open(hid_t in, const std::string& path) {
  Handle at(H5Oopen(in, ".", H5P_DEFAULT), H5Oclose);
  for (std::size_t begin = 0; begin < path.size();) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    const std::string name = path.substr(begin, end - begin);
    H5L_info_t link;
    if (H5Lexists(at, name.c_str(), H5P_DEFAULT) <= 0 ||
        H5Lget_info(at, name.c_str(), &link, H5P_DEFAULT) < 0)
      return {};
    if (link.type != H5L_TYPE_HARD) refuse(path + " is a link to elsewhere");
    at = Handle(H5Oopen(at, name.c_str(), H5P_DEFAULT), H5Oclose);
    if (!at.valid()) refuse(path + ": " + hdf5::last_failure());
    begin = end + 1;
  }
  return at;
}

bool is_group(hid_t object) { return H5Iget_type(object) == H5I_GROUP; }
bool is_dataset(hid_t object) { return H5Iget_type(object) == H5I_DATASET; }

std::vector<std::string> names_in(hid_t group) {
  H5G_info_t info;
  if (H5Gget_info(group, &info) < 0) refuse(hdf5::last_failure());
  std::vector<std::string> names;
  for (hsize_t i = 0; i < std::min<hsize_t>(info.nlinks, 1000); ++i) {
    char name[256] = {};
    if (H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, i, name, sizeof name,
                           H5P_DEFAULT) < 0)
      refuse(hdf5::last_failure());
    names.emplace_back(name);
  }
  return names;
}

Size size_of(hid_t space) {
  const int rank = H5Sget_simple_extent_ndims(space);
  if (rank < 0 || rank > 8) refuse("an array of so many dimensions");
  Size size(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(space, size.data(), nullptr);
  return size;
}

Numbers read(hid_t set, const std::string& path, bool last) {
  const Handle space(H5Dget_space(set), H5Sclose), type(H5Dget_type(set), H5Tclose),
      how(H5Dget_create_plist(set), H5Pclose);
  if (!space.valid() || !type.valid() || !how.valid()) refuse(hdf5::last_failure());
  if (!holds_numbers(type)) refuse(path + " has no numbers");
  if (H5Pget_layout(how) == H5D_VIRTUAL ||
      (H5Pget_layout(how) == H5D_CONTIGUOUS && H5Pget_external_count(how) != 0))
    refuse(path + " lies in other files");
  Numbers out;
  out.size = size_of(space);
  Handle memory(H5Scopy(space), H5Sclose);
  if (last) {
    if (out.size.empty() || out.size[0] == 0) refuse(path + " is empty");
    Size start(out.size.size(), 0), count = out.size;
    start[0] = out.size[0] - 1;
    count[0] = 1;
    if (H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) <
        0)
      refuse(hdf5::last_failure());
    memory = hdf5::space_of(count);
    out.size.erase(out.size.begin());
  }
  double many = 1;
  for (const hsize_t each : out.size) many *= static_cast<double>(each);
  if (many > static_cast<double>(kMostNumbers)) refuse(path + " is too large");
  out.values.resize(static_cast<std::size_t>(many));
  if (H5Dread(set, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, out.values.data()) < 0)
    refuse(path + ": " + hdf5::last_failure());
  for (const char* name : {"unit", "sim_unit"})
    if (out.unit.empty()) out.unit = text_of(set, name).value_or("");
  return out;
}

Numbers element(hid_t group, const std::string& name) {
  const Handle object = open(group, name);
  if (!object.valid()) return {};
  if (is_dataset(object)) return read(object, name, false);
  const Handle value = open(object, "value");
  if (!value.valid() || !is_dataset(value)) refuse(name + " has no value");
  return read(value, name, true);
}

std::vector<double> attribute(hid_t object, const char* name) {
  if (H5Aexists(object, name) <= 0) return {};
  const Handle found(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  const Handle space(H5Aget_space(found), H5Sclose), type(H5Aget_type(found), H5Tclose);
  if (!space.valid() || !type.valid() || !holds_numbers(type)) refuse(std::string(name) + "?");
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  if (count < 0 || count > 1000) refuse(std::string(name) + " is too long");
  std::vector<double> values(static_cast<std::size_t>(count));
  if (H5Aread(found, H5T_NATIVE_DOUBLE, values.data()) < 0) refuse(hdf5::last_failure());
  return values;
}

std::vector<std::string> texts(hid_t object, const char* name) {
  if (H5Aexists(object, name) <= 0) return {};
  const Handle found(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  const Handle space(H5Aget_space(found), H5Sclose), type(H5Aget_type(found), H5Tclose);
  if (!space.valid() || !type.valid() || H5Tget_class(type) != H5T_STRING) return {};
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  if (count < 1 || count > 1000) return {};
  std::vector<std::string> out;
  if (H5Tis_variable_str(type) > 0) {
    std::vector<char*> words(static_cast<std::size_t>(count), nullptr);
    if (H5Aread(found, type, words.data()) < 0) refuse(hdf5::last_failure());
    for (const char* word : words) out.emplace_back(word ? word : "");
    H5Dvlen_reclaim(type, space, H5P_DEFAULT, words.data());
  } else {
    const std::size_t length = H5Tget_size(type);
    if (length > kLongestText) refuse(std::string(name) + " is too long");
    std::string bytes(length * static_cast<std::size_t>(count), '\0');
    if (H5Aread(found, type, bytes.data()) < 0) refuse(hdf5::last_failure());
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      std::string word = bytes.substr(i * length, length);
      word.resize(std::min(word.find('\0'), word.size()));
      out.push_back(word);
    }
  }
  return out;
}

std::optional<std::string> text_of(hid_t object, const char* name) {
  const std::vector<std::string> found = texts(object, name);
  if (found.empty()) return {};
  return found.front();
}

}  // namespace sim::h5md
