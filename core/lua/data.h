// A Lua value as plain data, for those who may not see Lua.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "core/math/vec3.h"

namespace sim {

struct Data;

// The entries 1, 2, 3, ... without a hole, and all others: in the order of their keys when they
// come from Lua (numbers, then text), in the order of writing when they go there.
struct DataTable {
  std::vector<Data> list;
  std::vector<std::pair<Data, Data>> fields;
  std::size_t left_out = 0;  // entries beyond the limit of the conversion
};

// A Lua function, alive as long as this is.
struct DataFunction {
  std::shared_ptr<const int> reference;
};

// Describes a value that exists in Lua only, in a few words: "function", "cycle", ...
struct DataOpaque {
  std::string text;
};

struct Data {
  using Variant = std::variant<std::monostate, bool, std::int64_t, double, std::string,
                               DataFunction, DataOpaque, std::shared_ptr<const DataTable>>;
  Variant value;

  Data() = default;
  template <class T>
  requires(!std::is_same_v<std::decay_t<T>, Data> && std::is_constructible_v<Variant, T>)
      Data(T&& given)
      : value(std::forward<T>(given)) {}
  Data(int given) : value(std::int64_t{given}) {}
  Data(const char* given) : value(std::string(given)) {}
  Data(const Vec3& v);
  Data(std::vector<Data> list);
  Data(std::vector<std::pair<Data, Data>> fields);

  bool nil() const { return value.index() == 0; }
  bool truth() const;  // by Lua's rules
  const DataTable* table() const;
};

inline Data::Data(std::vector<Data> list)
    : value(std::make_shared<const DataTable>(DataTable{std::move(list), {}, 0})) {}
inline Data::Data(std::vector<std::pair<Data, Data>> fields)
    : value(std::make_shared<const DataTable>(DataTable{{}, std::move(fields), 0})) {}
inline Data::Data(const Vec3& v) : Data(std::vector<Data>{Data(v[0]), Data(v[1]), Data(v[2])}) {}

inline bool Data::truth() const {
  const bool* flag = std::get_if<bool>(&value);
  return flag ? *flag : !nil();
}

inline const DataTable* Data::table() const {
  const auto* held = std::get_if<std::shared_ptr<const DataTable>>(&value);
  return held ? held->get() : nullptr;
}

}  // namespace sim
