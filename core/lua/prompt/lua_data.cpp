#include "core/lua/prompt/lua_data.h"

#include <algorithm>
#include <cstring>

#include "core/base/text.h"

namespace sim {
namespace {

constexpr std::size_t kDeepest = 40;
constexpr std::size_t kMostValues = 10'000'000;  // tables that share tables can unfold to more

class Reader {
 public:
  Reader(lua_State* L, std::size_t most, DataFunction (*functions)(lua_State*, int))
      : L_(L), most_(most), functions_(functions) {}

  Data read(int index);

 private:
  Data table(int index);
  std::string words(int index);

  lua_State* L_;
  std::size_t most_;
  DataFunction (*functions_)(lua_State*, int);
  std::size_t values_ = 0;
  std::vector<const void*> above_;  // the tables that this one is in
};

std::string Reader::words(int index) {
  if (lua_type(L_, index) != LUA_TFUNCTION) return luaL_typename(L_, index);
  lua_Debug info;
  lua_pushvalue(L_, index);
  lua_getinfo(L_, ">S", &info);
  if (std::strcmp(info.what, "C") == 0 || std::strcmp(info.source, kLanguageSource) == 0)
    return "function";
  return "function at " + chunk_place(lua_place(info.source, info.linedefined));
}

Data Reader::read(int index) {
  if (++values_ > std::min(kMostValues, 50 * std::min(most_, kMostValues)))
    return DataOpaque{"..."};
  switch (lua_type(L_, index)) {
    case LUA_TNIL:
    case LUA_TNONE:
      return {};
    case LUA_TBOOLEAN:
      return lua_toboolean(L_, index) != 0;
    case LUA_TNUMBER:
      if (lua_isinteger(L_, index)) return std::int64_t{lua_tointeger(L_, index)};
      return double{lua_tonumber(L_, index)};
    case LUA_TSTRING:
      return std::string(lua_tostring(L_, index), lua_rawlen(L_, index));
    case LUA_TTABLE:
      return table(lua_absindex(L_, index));
    case LUA_TFUNCTION:
      if (functions_) return functions_(L_, index);
      [[fallthrough]];
    default:
      return DataOpaque{words(index)};
  }
}

// Numbers before text before anything else; within a kind by value.
bool before(const Data& a, const Data& b) {
  const auto number = [](const Data& key) -> const double* {
    return std::get_if<double>(&key.value);
  };
  const auto rank = [&](const Data& key) {
    return std::holds_alternative<std::int64_t>(key.value) || number(key) ? 0
           : std::holds_alternative<std::string>(key.value)               ? 1
                                                                          : 2;
  };
  if (rank(a) != rank(b)) return rank(a) < rank(b);
  if (rank(a) == 0) {
    const auto value = [&](const Data& key) {
      return number(key) ? *number(key) : static_cast<double>(std::get<std::int64_t>(key.value));
    };
    return value(a) < value(b);
  }
  return rank(a) == 1 && std::get<std::string>(a.value) < std::get<std::string>(b.value);
}

Data Reader::table(int index) {
  luaL_checkstack(L_, LUA_MINSTACK, "printing a table");
  if (luaL_getmetafield(L_, index, "__tostring") != LUA_TNIL) {
    lua_pop(L_, 1);
    const DataOpaque text{luaL_tolstring(L_, index, nullptr)};
    lua_pop(L_, 1);
    return text;
  }
  const void* self = lua_topointer(L_, index);
  if (std::find(above_.begin(), above_.end(), self) != above_.end()) return DataOpaque{"cycle"};
  if (above_.size() >= kDeepest) return DataOpaque{"nested too deeply"};
  above_.push_back(self);

  DataTable result;
  const auto length = static_cast<lua_Integer>(lua_rawlen(L_, index));
  for (lua_Integer i = 1; i <= length; ++i) {
    if (result.list.size() == most_) {
      result.left_out += static_cast<std::size_t>(length - i + 1);
      break;
    }
    lua_rawgeti(L_, index, i);
    result.list.push_back(read(-1));
    lua_pop(L_, 1);
  }
  // Keys first, for only the first of them in order are read.
  std::vector<std::pair<Data, int>> keys;
  lua_newtable(L_);
  const int kept = lua_gettop(L_);
  for (lua_pushnil(L_); lua_next(L_, index); lua_pop(L_, 1)) {
    if (lua_isinteger(L_, -2) && lua_tointeger(L_, -2) >= 1 && lua_tointeger(L_, -2) <= length)
      continue;
    const int type = lua_type(L_, -2);
    keys.emplace_back(type == LUA_TTABLE ? Data(DataOpaque{"table"}) : read(-2),
                      static_cast<int>(keys.size()) + 1);
    lua_pushvalue(L_, -2);
    lua_rawseti(L_, kept, keys.back().second);
  }
  std::stable_sort(keys.begin(), keys.end(),
                   [](const auto& a, const auto& b) { return before(a.first, b.first); });
  for (auto& [key, slot] : keys) {
    if (result.fields.size() == most_) {
      result.left_out += keys.size() - most_;
      break;
    }
    lua_rawgeti(L_, kept, slot);
    lua_rawget(L_, index);
    result.fields.emplace_back(std::move(key), read(-1));
    lua_pop(L_, 1);
  }
  lua_pop(L_, 1);
  above_.pop_back();
  return std::make_shared<const DataTable>(std::move(result));
}

}  // namespace

Data to_data(lua_State* L, int index, std::size_t most,
             DataFunction (*functions)(lua_State* L, int index)) {
  return Reader(L, most, functions).read(index);
}

void push_data(lua_State* L, const Data& data) {
  luaL_checkstack(L, 4, "values of the host");
  struct Push {
    lua_State* L;
    void operator()(std::monostate) const { lua_pushnil(L); }
    void operator()(bool flag) const { lua_pushboolean(L, flag); }
    void operator()(std::int64_t number) const { lua_pushinteger(L, number); }
    void operator()(double number) const { lua_pushnumber(L, number); }
    void operator()(const std::string& text) const { lua_pushlstring(L, text.data(), text.size()); }
    void operator()(const DataFunction& f) const {
      lua_rawgeti(L, LUA_REGISTRYINDEX, *f.reference);
    }
    void operator()(const DataOpaque& words) const { (*this)(words.text); }
    void operator()(const std::shared_ptr<const DataTable>& table) const {
      lua_createtable(L, static_cast<int>(table->list.size()),
                      static_cast<int>(table->fields.size()));
      for (std::size_t i = 0; i < table->list.size(); ++i) {
        push_data(L, table->list[i]);
        lua_rawseti(L, -2, static_cast<lua_Integer>(i) + 1);
      }
      for (const auto& [key, value] : table->fields) {
        push_data(L, key);
        push_data(L, value);
        lua_rawset(L, -3);
      }
    }
  };
  std::visit(Push{L}, data.value);
}

SourceLocation chunk_place(const SourceLocation& place) {
  const std::size_t last = place.rfind(':');
  if (last == SourceLocation::npos || last == 0) return place;
  const std::size_t first = place.rfind(':', last - 1);
  if (first == SourceLocation::npos) return place;
  const auto line = parse_integer(std::string_view(place).substr(last + 1));
  const auto begin = parse_integer(std::string_view(place).substr(first + 1, last - first - 1));
  if (!line || !begin) return place;
  return place.substr(0, first) + ":" + std::to_string(*begin + *line - 1);
}

}  // namespace sim
