// The types of the scene language itself for editors, in LuaCATS; those of plugins come from their
// declarations (luacats.cpp).
#pragma once

#include <span>

namespace sim::cli {

// A function or method of the language. Its documents are the comments of scripts/sim/init.lua.
struct LanguageFunction {
  const char* owner;      // "sim", or the class whose method it is
  const char* name;       // also of its documents
  const char* arguments;  // "id, path"
  const char* types;      // lines of LuaCATS: ---@param, ---@return
};

std::span<const LanguageFunction> language_functions();

// Classes: what functions return, and the tables that they take. Exact ones have no other keys.
extern const char* const kLanguageClasses;

}  // namespace sim::cli
