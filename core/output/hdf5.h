// RAII handles of HDF5 objects, for the few users of this library; the kernel does not use it.
#pragma once

#include <hdf5.h>

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace sim::hdf5 {

// The library's message about its last failure, or the system's if there is one.
inline std::string last_failure() {
  std::string text;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned, const H5E_error2_t* error, void* data) -> herr_t {
        auto& said = *static_cast<std::string*>(data);
        const std::string words = error->desc ? error->desc : "";
        const std::string mark = "error message = '";
        if (const auto at = words.find(mark); at != std::string::npos)
          said =
              words.substr(at + mark.size(), words.find('\'', at + mark.size()) - at - mark.size());
        else if (said.empty())
          said = words;
        return 0;
      },
      &text);
  H5Eclear2(H5E_DEFAULT);
  return text.empty() ? "the library failed" : text;
}

// An identifier of the library; negative: none.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);

  Handle() = default;
  Handle(hid_t id, Close how) : id_(id), close_(how) {}
  ~Handle() { close(); }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }

  bool valid() const { return id_ >= 0; }
  operator hid_t() const { return id_; }
  bool close() { return id_ < 0 || close_(std::exchange(id_, -1)) >= 0; }  // false: it failed

 private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

inline Handle space_of(const std::vector<hsize_t>& size) {
  return {size.empty() ? H5Screate(H5S_SCALAR)
                       : H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr),
          H5Sclose};
}

// Text of so many bytes, without a terminator.
inline Handle text_type(std::size_t length) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, length == 0 ? 1 : length);
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  H5Tset_cset(type, H5T_CSET_UTF8);
  return type;
}

// Turns off the library's own messages, and its cleanup at the end of the process.
inline void be_quiet() {
  H5dont_atexit();
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

}  // namespace sim::hdf5
