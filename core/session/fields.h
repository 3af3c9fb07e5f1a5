// The fields of plain structs as data: code that visits all of them misses none that is added
// later.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string_view>
#include <tuple>
#include <type_traits>

namespace sim {

struct StructField {
  const char* name;
  bool identifies = true;  // a value with another one is another value; else it describes it

  // FNV-1a of the name (Fowler, Noll & Vo).
  constexpr std::uint64_t hash() const {
    std::uint64_t hash = 0xcbf29ce484222325;
    for (const char c : std::string_view(name))
      hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
    return hash;
  }
};

// A specialisation has `static constexpr StructField list[]`: all fields of the struct, in their
// order. One that misses a field does not compile, see tie_fields().
template <class T>
struct FieldsOf;

template <class T>
concept HasFields = requires {
  FieldsOf<std::remove_const_t<T>>::list;
};

// References to all fields of a struct.
template <HasFields T>
constexpr auto tie_fields(T& value) {
  constexpr std::size_t kCount = std::size(FieldsOf<std::remove_const_t<T>>::list);
  if constexpr (kCount == 2) {
    auto& [a, b] = value;
    return std::tie(a, b);
  } else if constexpr (kCount == 3) {
    auto& [a, b, c] = value;
    return std::tie(a, b, c);
  } else if constexpr (kCount == 4) {
    auto& [a, b, c, d] = value;
    return std::tie(a, b, c, d);
  } else if constexpr (kCount == 5) {
    auto& [a, b, c, d, e] = value;
    return std::tie(a, b, c, d, e);
  } else if constexpr (kCount == 6) {
    auto& [a, b, c, d, e, f] = value;
    return std::tie(a, b, c, d, e, f);
  } else if constexpr (kCount == 7) {
    auto& [a, b, c, d, e, f, g] = value;
    return std::tie(a, b, c, d, e, f, g);
  } else if constexpr (kCount == 8) {
    auto& [a, b, c, d, e, f, g, h] = value;
    return std::tie(a, b, c, d, e, f, g, h);
  } else if constexpr (kCount == 9) {
    auto& [a, b, c, d, e, f, g, h, i] = value;
    return std::tie(a, b, c, d, e, f, g, h, i);
  } else if constexpr (kCount == 10) {
    auto& [a, b, c, d, e, f, g, h, i, j] = value;
    return std::tie(a, b, c, d, e, f, g, h, i, j);
  } else if constexpr (kCount == 12) {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l] = value;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k, l);
  } else {
    static_assert(kCount == 23, "write the case of as many fields");
    auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w] = value;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w);
  }
}

// Calls visit(StructField, field) for each field, in their order.
template <HasFields T, class Visit>
constexpr void each_field(T& value, Visit visit) {
  const StructField* field = FieldsOf<std::remove_const_t<T>>::list;
  std::apply([&](auto&... fields) { (visit(*field++, fields), ...); }, tie_fields(value));
}

}  // namespace sim
