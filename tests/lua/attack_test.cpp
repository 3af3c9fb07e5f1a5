// Scenes that try to run for ever or to take all memory: each ends in an error that names the line.
#include <csignal>

#include "core/lua/prompt/prompt.h"
#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

// Counted, not timed, so that slow machines see the same; the time is for what escapes the count.
constexpr LuaLimits kLimits{.seconds = 20, .memory = 64 << 20, .steps = 100'000};

struct Attack {
  const char *name, *code;
  int line = 1;  // of the code, that the error names
};

// Each is a chunk that would not end, or would take all memory.
const Attack kAttacks[] = {
    {"an empty loop", "while true do end"},
    {"repeat", "repeat until false"},
    {"a numeric loop", "for i = 1, math.huge do end"},
    {"a long integer loop", "for i = 1, math.maxinteger do end"},
    {"goto", "::again:: goto again"},
    {"goto over lines", "::again::\nlocal x = 1\ngoto again", 0},
    {"tail calls", "local function f() return f() end f()"},
    {"two functions", "local f, g function f() return g() end function g() return f() end f()"},
    {"pcall in a loop", "while true do pcall(error) end"},
    {"a loop in pcall in a loop", "while true do pcall(function() while true do end end) end"},
    {"pcall returned", "return pcall(function() while true do end end)"},
    {"pcall of pcall", "local f function f() while true do pcall(f) end end pcall(f)"},
    {"xpcall with a handler that loops",
     "xpcall(function() while true do end end, function() while true do end end)"},
    {"a handler that fails", "xpcall(function() while true do end end, function(m) error(m) end)"},
    {"a handler after an error", "xpcall(error, function() while true do end end)"},
    {"xpcall in a loop", "while true do xpcall(error, print and function() return 1 end) end"},
    {"xpcall in a coroutine",
     "coroutine.wrap(function() xpcall(function() while true do end end, function() while true do "
     "end end) end)()"},
    {"a coroutine", "coroutine.wrap(function() while true do end end)()"},
    {"resume",
     "while true do coroutine.resume(coroutine.create(function() while true do end end)) "
     "end"},
    {"a generator",
     "for x in coroutine.wrap(function() while true do coroutine.yield(1) end end) "
     "do end"},
    {"short coroutines",
     "while true do coroutine.wrap(function() for i = 1, 300 do end end)() end"},
    {"a tree of coroutines",
     "local function grow(depth) if depth == 0 then return end\nfor i = 1, 30 do "
     "coroutine.wrap(grow)(depth - 1) end end\ngrow(40)",
     0},
    {"pcall in a coroutine",
     "coroutine.wrap(function() while true do pcall(function() while true "
     "do end end) end end)()"},
    {"__close",
     "local x <close> = setmetatable({}, {__close = function() while true do end end})\n"
     "while true do end",
     0},
    {"__close in a coroutine",
     "coroutine.wrap(function() local x <close> = setmetatable({}, {__close = function() while "
     "true "
     "do end end}) while true do end end)()"},
    {"__close in a coroutine that is closed",
     "local co = coroutine.create(function() local x <close> = setmetatable({}, {__close = "
     "function() while true do end end}) while true do end end)\ncoroutine.resume(co) "
     "coroutine.close(co)",
     0},
    {"__close that fails in a loop",
     "while true do pcall(function() local x <close> = setmetatable({}, {__close = error}) end) "
     "end"},
    {"__gc", "setmetatable({}, {__gc = function() while true do end end})"},
    {"__gc of many", "for i = 1, 1e9 do setmetatable({}, {__gc = function() end}) end"},
    {"__index",
     "local t = setmetatable({}, {__index = function(t, k) while true do end end}) "
     "local x = t.x"},
    {"__len",
     "local t = setmetatable({}, {__len = function() while true do end end}) local x = #t"},
    {"__eq",
     "local m = {__eq = function() while true do end end} local x = setmetatable({}, m) == "
     "setmetatable({}, m)"},
    {"__tostring", "tostring(setmetatable({}, {__tostring = function() while true do end end}))"},
    {"__concat",
     "local x = setmetatable({}, {__concat = function() while true do end end}) .. 'x'"},
    {"__call", "setmetatable({}, {__call = function() while true do end end})()"},
    {"__pairs",
     "for x in pairs(setmetatable({}, {__pairs = function() while true do end end})) do "
     "end"},
    {"a table that counts for ever",
     "for i, x in ipairs(setmetatable({}, {__index = function(t, i) return i end})) do end"},
    {"a pattern that backtracks", "string.find(('a'):rep(60), ('a*'):rep(30) .. 'b')"},
    {"a lazy pattern", "string.match(('a'):rep(60), ('a-'):rep(30) .. 'b')"},
    {"optional items", "string.find(('a'):rep(60), ('a?'):rep(60) .. ('a'):rep(60) .. 'b')"},
    {"a pattern in gsub", "string.gsub(('a'):rep(60), ('a*'):rep(30) .. 'b', '')"},
    {"a pattern in gmatch", "for x in string.gmatch(('a'):rep(60), ('a*'):rep(30) .. 'b') do end"},
    {"a quadratic pattern", "string.find(('a'):rep(1e6), '.-b')"},
    {"captures", "string.find(('a'):rep(60), ('(a*)'):rep(30) .. '%1b')"},
    {"balanced texts", "string.find(('('):rep(1e6), '%b()')"},
    {"a large set", "string.find(('a'):rep(1e5), '[' .. ('b'):rep(1e5) .. ']')"},
    {"gsub with a function of the library", "string.gsub(('a'):rep(1e7), '.', string.upper)"},
    {"gsub that grows", "string.gsub(('a'):rep(1e5), '.', ('b'):rep(1e5))"},
    {"gsub with pcall", "while true do string.gsub('aaa', '.', pcall) end"},
    {"rep of nothing", "local s = (''):rep(1 << 62) while true do end"},
    {"rep", "while true do local s = ('x'):rep(1e6) end"},
    {"rep that is too long", "('x'):rep(1e9)"},
    {"pcall of rep", "while true do pcall(string.rep, 'x', 1e9) end"},
    {"concatenation", "local s = 'x' while true do s = s .. s end"},
    {"upper case", "local s = ('x'):rep(1e6) while true do s:upper() end"},
    {"format", "local s = ('x'):rep(1e6) while true do string.format('%s%s', s, s) end"},
    {"pack", "string.pack(('c1000000'):rep(100), ('x'):rep(100))"},
    {"bytes", "local s = ('x'):rep(1e5) while true do local a = s:byte(1, -1) end"},
    {"utf8", "local s = ('x'):rep(1e6) while true do utf8.len(s) end"},
    {"comparing",
     "local a, b = ('x'):rep(1e6) .. 'a', ('x'):rep(1e6) .. 'b' while true do local c = "
     "a < b end"},
    {"a table that grows", "local t = {} while true do t[#t + 1] = {} end"},
    {"a closure that grows",
     "local f = print while true do local g = f f = function() return g end "
     "end"},
    {"table.move of nothing", "table.move({}, 1, math.maxinteger - 1, 2)"},
    {"table.move down", "table.move({}, 2, math.maxinteger, 1)"},
    {"table.insert",
     "table.insert(setmetatable({}, {__len = function() return 1 << 62 end}), 1, 0)"},
    {"table.remove", "table.remove(setmetatable({}, {__len = function() return 1 << 62 end}), 1)"},
    {"table.concat",
     "table.concat(setmetatable({}, {__index = function() return '' end}), '', 1, 1 "
     "<< 62)"},
    {"table.concat of the library",
     "table.concat(setmetatable({}, {__index = string.rep and "
     "setmetatable({}, {__index = string.char})}), '', 1, 1 << 62)"},
    {"table.unpack", "while true do table.unpack({}, 1, 1e5) end"},
    {"sort with a bad order",
     "while true do pcall(table.sort, {3, 1, 2, 5, 4, 9, 8, 7}, function() "
     "return true end) end"},
    {"sort with an order of the library",
     "local t = {} for i = 1, 2000 do t[i] = 1 end while true do pcall(table.sort, t, rawequal) "
     "end"},
    {"a long sort", "local t = {} for i = 1, 1e4 do t[i] = tostring(i % 77) end table.sort(t)"},
    {"a sort of a length",
     "table.sort(setmetatable({}, {__len = function() return 1 << 30 end, "
     "__index = function() return 1 end}))"},
    {"next", "local t = {} for i = 1, 2e4 do t[i] = i end while next(t) do t[next(t)] = nil end"},
    {"pairs",
     "local t = {} for i = 1, 1000 do t[i] = i end while true do for k in pairs(t) do end "
     "end"},
    {"an unknown global",
     "for i = 1, 400 do _G['x' .. i] = 1 end while true do pcall(function() "
     "return nothing end) end"},
    {"require", "while true do pcall(require, 'nothing') end"},
    {"parameters", "local sim = require 'sim' for i = 1, 1e9 do sim.arg('a' .. i, i) end"},
    {"select", "local t = {} local function f(...) return f(1, ...) end f()"},
    {"recursion", "local function f() return 1 + f() end while true do pcall(f) end"},
    {"a state that grows",
     "local sim = require 'sim' local p = sim.particles { mass = 1 } while "
     "true do p:add {0, 0, 0} end"},
    {"a chain of handles", "local sim = require 'sim' while true do sim.force.gravity {} end"},
    {"print", "while true do local f = tostring f('x') end"},
};

// "scene.lua:3" of an attack that begins in a line of a scene.
bool names_line(const Error& error, const Attack& attack, int first) {
  const std::string& where = error.text().where;
  if (attack.line == 0) return contains(where, "scene.lua:");
  return where.ends_with("scene.lua:" + std::to_string(first + attack.line - 1));
}

// The error of a scene, and of all that its functions do in a step.
std::optional<Error> attacked(Registry& registry, const std::string& text, bool step) {
  const SceneFolder folder;
  try {
    const SceneSpec spec =
        load_scene(folder.write("scene.lua", text), registry, {search_path(), {}, 0, kLimits});
    for (const SystemSpec& each : spec.systems) {
      Simulation system(each, registry);
      if (step) system.step();
      for (const ObserverSpec& observer : each.observers) observer.value(system);
    }
  } catch (const Error& error) {
    return error;
  }
  return {};
}

}  // namespace

TEST_CASE("a hostile scene ends in an error that names the line", "[lua][attack]") {
  Registry registry({SIM_PLUGIN_DIR});
  for (const Attack& attack : kAttacks) {
    INFO(attack.name);
    const auto error = attacked(registry, std::string(attack.code) + "\n", false);
    REQUIRE(error);
    INFO(error->what());
    CHECK(error->kind() == ErrorKind::kScene);
    CHECK(names_line(*error, attack, 1));
  }
}

// The code of every attack in each of the functions that a run calls.
TEST_CASE("a hostile function ends the run in an error that names the line", "[lua][attack]") {
  const struct {
    const char *name, *before, *after;
  } places[] = {
      {"field", "sim.scene { state = {1}, field = sim.field.lua { function(t, x)\n",
       "\nend }, integrator = 'rk4', dt = 0.1, duration = 1 }\n"},
      {"force", "sim.scene { particles = p, forces = { sim.force.lua { function(t, i, x, v)\n",
       "\nend } }, integrator = 'rk4', dt = 0.1, duration = 1 }\n"},
      {"motion",
       "sim.scene { particles = p, forces = {}, colliders = { sim.collider.sphere { radius = 1, "
       "motion = function(t)\n",
       "\nend } }, integrator = 'rk4', dt = 0.1, duration = 1 }\n"},
      {"observer",
       "sim.scene { state = {1}, field = sim.field.lua { function(t, x) return { 0 } end }, "
       "integrator = 'rk4', dt = 0.1, duration = 1, observe = { o = function(s)\n",
       "\nend } }\n"},
  };
  Registry registry({SIM_PLUGIN_DIR});
  for (const auto& place : places)
    for (const Attack& attack : kAttacks) {
      // A few run once only: what they made, or their parameters, stay.
      if (std::string(attack.name) == "parameters") continue;
      INFO(place.name << ": " << attack.name);
      const auto error = attacked(registry,
                                  "local sim = require 'sim'\nlocal p = sim.particles { mass = 1 "
                                  "} p:add {0, 0, 0}\nreturn " +
                                      std::string(place.before) + attack.code + place.after,
                                  true);
      REQUIRE(error);
      INFO(error->what());
      CHECK(error->kind() == ErrorKind::kScene);
      CHECK(names_line(*error, attack, 4));
    }
}

TEST_CASE("a hostile line at the prompt ends, and the next one goes on", "[lua][attack]") {
  Registry registry({SIM_PLUGIN_DIR});
  Prompt prompt({search_path(), {}, 0, kLimits}, registry, [](const std::string&) {});
  prompt.run("kept = {1, 2, 3}", "test", 1, 10);
  for (const Attack& attack : kAttacks) {
    INFO(attack.name);
    CHECK_THROWS_AS(prompt.run(attack.code, "test", 1, 10), Error);
    const std::vector<Data> after = prompt.run("#kept + kept[3]", "test", 2, 10);
    REQUIRE(after.size() == 1);
    CHECK(std::get<std::int64_t>(after[0].value) == 6);
  }
}

// The close handlers of a stopped coroutine would run without an end.
TEST_CASE("a stopped coroutine cannot be closed", "[lua][attack]") {
  Registry registry({SIM_PLUGIN_DIR});
  Prompt prompt({search_path(), {}, 0, kLimits}, registry, [](const std::string&) {});
  CHECK_THROWS_AS(
      prompt.run("co = coroutine.create(function() local x <close> = setmetatable({}, {__close = "
                 "function() while true do end end}) while true do end end) coroutine.resume(co)",
                 "test", 1, 10),
      Error);
  try {
    prompt.run("coroutine.close(co)", "test", 2, 10);
    FAIL("no error");
  } catch (const Error& error) {
    CHECK(contains(error.text().why, "was stopped"));
  }
}

namespace {
volatile std::sig_atomic_t stop_now = 0;
}

TEST_CASE("a question for the end is answered in the middle of a library call", "[lua][attack]") {
  const SceneFolder folder;
  Registry registry({SIM_PLUGIN_DIR});
  for (const char* code : {"while true do end", "string.find(('a'):rep(60), ('a*'):rep(30) .. 'b')",
                           "table.move({}, 1, math.maxinteger - 1, 2)",
                           "while true do local s = ('x'):rep(1e6) end"}) {
    INFO(code);
    stop_now = 1;
    try {
      SceneOptions options;
      options.search_path = search_path();
      options.interrupted = [] { return stop_now != 0; };
      load_scene(folder.write("scene.lua", code), registry, options);
      FAIL("no error");
    } catch (const Error& error) {
      CHECK(error.text().why == "interrupted");
    }
  }
}

TEST_CASE("honest work meets no limit", "[lua][attack]") {
  CHECK_NOTHROW(load_text(
      "local t = {} for i = 1, 1e5 do t[#t + 1] = math.sin(i) end\n"
      "table.sort(t) for i = 2, #t do assert(t[i - 1] <= t[i]) end\n"
      "table.sort(t, function(a, b) return a > b end) assert(t[1] > 0.9999)\n"
      "table.insert(t, 1, 5) assert(table.remove(t, 1) == 5 and #t == 1e5)\n"
      "assert(#table.concat(table.move(t, 1, 100, 1, {}), ',') > 1000)\n"
      "assert(select('#', table.unpack(t, 1, 1000)) == 1000)\n"
      "local words = 0 for w in (('word '):rep(1e4)):gmatch('%a+') do words = words + 1 end\n"
      "assert(words == 1e4 and ('abc'):rep(3, '-') == 'abc-abc-abc')\n"
      "local co = coroutine.wrap(function(a) while true do a = coroutine.yield(a + 1) end end)\n"
      "for i = 1, 1e4 do assert(co(i) == i + 1) end\n"
      "assert(select(2, xpcall(error, function(m) return m .. '!' end, 'x')) == 'x!')\n"
      "assert(select('#', xpcall(select, print, 2, 1, 2, 3)) == 3)\n"
      "local particles = sim.particles {} particles:add {0, 0, 0}\nlocal forces = {}\n" +
      kEnd));
}

namespace {

std::string shown(const Data& value) {
  if (const auto* text = std::get_if<std::string>(&value.value)) return "string:" + *text + "|";
  if (const auto* whole = std::get_if<std::int64_t>(&value.value))
    return "number:" + std::to_string(*whole) + "|";
  if (const auto* flag = std::get_if<bool>(&value.value))
    return *flag ? "boolean:true|" : "boolean:false|";
  return value.nil() ? "nil:nil|" : "?";
}

}  // namespace

TEST_CASE("the bounded functions give what those of Lua give", "[lua][attack]") {
  std::ifstream file(std::string(SIM_SOURCE_DIR) + "/tests/reference/lua_library.tsv");
  Registry registry({SIM_PLUGIN_DIR});
  Prompt prompt({search_path(), {}, 0, {}}, registry, [](const std::string&) {});
  int rows = 0;
  for (std::string line; std::getline(file, line);) {
    const std::size_t tab = line.find('\t');
    if (tab == std::string::npos || line.starts_with('#')) continue;
    const std::string code = line.substr(0, tab);
    INFO(code);
    std::string got;
    try {
      for (const Data& value : prompt.run(code, "test", 1, 100)) got += shown(value);
    } catch (const Error& error) {
      got = "E:" + error.text().why;
    }
    CHECK(got == line.substr(tab + 1));
    ++rows;
  }
  CHECK(rows > 150);
}
