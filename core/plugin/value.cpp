#include "core/plugin/value.h"

#include <utility>

#include "core/particles/collider.h"

namespace sim {

Value::Value() = default;
Value::Value(bool flag) : AnyValue(flag) {}
Value::Value(std::int64_t integer) : AnyValue(integer) {}
Value::Value(double number) : AnyValue(number) {}
Value::Value(std::string text) : AnyValue(std::move(text)) {}
Value::Value(Vec3 vector) : AnyValue(vector) {}
Value::Value(const Value& other) = default;
Value::Value(Value&& other) noexcept = default;
Value& Value::operator=(const Value& other) = default;
Value& Value::operator=(Value&& other) noexcept = default;
Value::~Value() = default;

ValueMap::ValueMap() = default;
ValueMap::ValueMap(std::initializer_list<value_type> values) : map(values) {}
ValueMap::ValueMap(const ValueMap& other) = default;
ValueMap::ValueMap(ValueMap&& other) noexcept = default;
ValueMap& ValueMap::operator=(const ValueMap& other) = default;
ValueMap& ValueMap::operator=(ValueMap&& other) noexcept = default;
ValueMap::~ValueMap() = default;

}  // namespace sim
