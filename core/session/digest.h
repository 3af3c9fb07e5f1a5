// A 64-bit digest of all contents of a value, field by field.
#pragma once

#include <cstdint>
#include <filesystem>
#include <iterator>
#include <memory>
#include <ranges>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "core/base/hash.h"
#include "core/session/fields.h"

namespace sim {

// Other types than structs with FieldsOf and standard ones need an overload in this namespace.
template <class T>
std::uint64_t digest(const T& value);
template <class T>
std::uint64_t digest(const std::shared_ptr<T>& value);

// Calls visit(StructField, field, its digest) for the fields that identify a value, without those
// that are as in a new one: a field that is added later changes no digest of a value that does not
// use it.
template <HasFields T, class Visit>
void each_own_field(const T& value, Visit visit) {
  const T plain{};
  const auto fields = tie_fields(value), plain_fields = tie_fields(plain);
  const auto look = [&]<std::size_t I>(std::integral_constant<std::size_t, I>) {
    if constexpr (constexpr StructField field = FieldsOf<T>::list[I]; field.identifies) {
      const std::uint64_t own = digest(std::get<I>(fields));
      if (own != digest(std::get<I>(plain_fields))) visit(field, std::get<I>(fields), own);
    }
  };
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    (look(std::integral_constant<std::size_t, I>()), ...);
  }
  (std::make_index_sequence<std::size(FieldsOf<T>::list)>());
}

namespace digest_detail {

template <HasFields T>
std::uint64_t of_fields(const T& value) {
  StateHash hash;
  each_own_field(value, [&](const StructField& field, const auto&, std::uint64_t own) {
    hash.add(field.hash());
    hash.add(own);
  });
  return hash.value();
}

template <class Range>
std::uint64_t of_range(const Range& range) {
  StateHash hash;
  std::uint64_t count = 0;
  for (const auto& each : range) {
    hash.add(digest(each));
    ++count;
  }
  hash.add(count);
  return hash.value();
}

}  // namespace digest_detail

template <class T>
std::uint64_t digest(const T& value) {
  StateHash hash;
  if constexpr (std::is_enum_v<T> || std::is_integral_v<T>) {
    hash.add(static_cast<std::uint64_t>(value));
  } else if constexpr (std::is_same_v<T, double>) {
    hash.add(value);
  } else if constexpr (std::is_same_v<T, std::filesystem::path>) {
    return digest(value.string());
  } else if constexpr (HasFields<T>) {
    return digest_detail::of_fields(value);
  } else if constexpr (std::is_same_v<T, std::monostate>) {
    return 0;
  } else if constexpr (requires { value.target_type(); }) {
    hash.add(std::uint64_t{static_cast<bool>(value)});  // the code of a function is no value
  } else if constexpr (std::ranges::range<const T>) {
    return digest_detail::of_range(value);
  } else if constexpr (requires { value.has_value(); }) {
    hash.add(std::uint64_t{value.has_value()});
    if (value) hash.add(digest(*value));
  } else if constexpr (requires { value.first, value.second; }) {
    hash.add(digest(value.first));
    hash.add(digest(value.second));
  } else {
    static_assert(
        requires { value.index(); }, "this type needs an overload of digest()");
    hash.add(static_cast<std::uint64_t>(value.index()));
    hash.add(std::visit([](const auto& content) { return digest(content); }, value));
  }
  return hash.value();
}

template <class T>
std::uint64_t digest(const std::shared_ptr<T>& value) {
  return value ? digest(*value) : 0;
}

}  // namespace sim
