// The library of scenes, whose work is counted, answers as Lua's own does.
#include <lua.hpp>

#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

// Lua that collects words in the list `out`, and what it collected in hexadecimal digits.
const char* const kBegin = R"(
local out = {}
local function say(...)
  local all = table.pack(...)
  for i = 1, all.n do out[#out + 1] = tostring(all[i]) end
  out[#out + 1] = ';'
end
)";
const char* const kEnd = R"(
local text = table.concat(out, ' ')
local hex = {}
for i = 1, #text do hex[i] = string.format('%02x', string.byte(text, i)) end
hex = table.concat(hex)
)";

std::string by_lua(const std::string& lines) {
  lua_State* const L = luaL_newstate();
  REQUIRE(L);
  luaL_openlibs(L);
  const bool failed = luaL_dostring(L, (kBegin + lines + kEnd + "return hex").c_str());
  const std::string result = lua_tostring(L, -1);
  lua_close(L);
  INFO(result);
  REQUIRE_FALSE(failed);
  return result;
}

void check(const std::string& lines) {
  const std::string right = by_lua(lines);
  CHECK(right.size() > 1000);
  const auto error = text_error(
      kBegin + lines + kEnd + "local right = '" + right +
      "'\nlocal i = 1\nwhile i <= #right and hex:sub(i, i) == right:sub(i, i) do i = i + 1 end\n"
      "if hex ~= right then error('differs at ' .. text:sub(i // 2 - 30, i // 2 + 30)) end\n"
      "return sim.scene { state = {1}, field = sim.field.lua { function(t, x) return {-x[1]} end "
      "}, integrator = 'rk4', dt = 0.1, duration = 1 }\n");
  INFO((error ? error->text().why : ""));
  CHECK_FALSE(error);
}

}  // namespace

// Every class and its complement over all bytes, sets, anchors, captures, %b, %f, repetitions.
TEST_CASE("patterns of scenes match what Lua's match", "[lua]") {
  check(R"lua(
local bytes = {}
for i = 0, 255 do bytes[#bytes + 1] = string.char(i) end
bytes = table.concat(bytes)
for class in ('acdglpsuwxACDGLPSUWX'):gmatch('.') do
  say(class, select(2, bytes:gsub('%' .. class, '')), bytes:find('%' .. class .. '+'))
  say(select(2, bytes:gsub('[%' .. class .. '_]', '')), select(2, bytes:gsub('[^%' .. class ..
    ']', '')))
end
local subjects = { '', 'a', 'abcabc', 'f(a(b)c)d) xx', 'THE (quick) fox, 12.5e-3 0x1F',
  'aXaYb[]^%]',
                   'x=1, y = 22;z=', '  two  words ', 'aaaa\0bbb\0', '((()', 'xyxyyx' }
local patterns = { 'a', '.', '.-', 'a*', 'a+', 'a-b', 'a?b', '^a', 'c$', '^$', '^.*$', '()',
  '(a)(b)',
                   '%b()', '%bxy', '%baa', '%f[%a]%a+', '%f[%d]', '(%a+)%s*=%s*(%d*)', '[%]]',
                     '[]]',
                   '[^]]', '[a-c]', '[^a-c]+', '[a-]', '[%a-z]', '(.)%1', '((a)(b))', '%(', '%.',
                     '%%',
                   '[%d.]+', '(%w+)%W+(%w+)', '%s*$', '\0', '[\0-\31]', '$', 'a$b', '^^',
                     '(()a())' }
for _, s in ipairs(subjects) do
  for _, p in ipairs(patterns) do
    say(p, s:find(p)); say(s:match(p)); say(s:gsub(p, '<%0>')); say(s:gsub(p, '', 2))
    for from = -3, 4 do say(s:find(p, from)); say(s:match(p, from)) end
    local n = 0
    for x, y in s:gmatch(p) do n = n + 1; say(n, x, y) end
    say(s:gsub(p, { a = 1, b = false }), s:gsub(p, function(x) return x == 'a' and 'Q' end))
    say(s:find(p, 1, true), s:find(p, 2, true))
  end
end
for _, p in ipairs { '%', '[a', '[^', '(', ')', '%b', '%bx', '%f', '%1', '(a', 'a)', '[%', '%2' }
  do
  for _, s in ipairs(subjects) do say(p, (pcall(string.find, s, p))) end
end
for _, r in ipairs { '%1', '%2', '%', '%x', '%%', '%0%0', '' } do
  say(r, pcall(string.gsub, 'abc', '(b)', r)); say((pcall(string.gsub, 'abc', 'b', r)))
end
)lua");
}

// Quicksort is not stable: equal entries end where Lua puts them.
TEST_CASE("lists of scenes are sorted as Lua sorts them, equal entries too", "[lua]") {
  check(R"lua(
local random = 12345
local function next_of(n) random = (random * 1103515245 + 12345) % 2147483648; return random //
  65536 % n end
for _, n in ipairs { 0, 1, 2, 3, 4, 5, 7, 10, 31, 99, 100, 101, 102, 103, 150, 400 } do
  for _, kinds in ipairs { 3, 10, 1000 } do
    local list, words = {}, {}
    for i = 1, n do list[i] = { key = next_of(kinds), at = i }; words[i] = 'w' .. next_of(kinds)
      end
    local compared = 0
    table.sort(list, function(a, b) compared = compared + 1; return a.key < b.key end)
    say(n, kinds, compared)
    for i = 1, n do out[#out + 1] = list[i].key .. ':' .. list[i].at end
    table.sort(list, function(a, b) return a.at > b.at end)
    for i = 1, n do out[#out + 1] = tostring(list[i].key) end
    table.sort(words)
    say(table.unpack(words, 1, math.min(n, 60)))
  end
end
say((pcall(table.sort, { 3, 1, 2, 5, 4, 9, 8, 7, 6 }, function() return true end)))
say((pcall(table.sort, { 1, 'a' })), (pcall(table.sort, { {}, {} })))
)lua");
}

TEST_CASE("texts, tables and numbers of scenes are those of Lua", "[lua]") {
  check(R"lua(
for _, s in ipairs { '', 'a', 'Straw', 'x\0y', ('long '):rep(9) } do
  for from = -6, 6 do
    for to = -6, 6 do say(s:sub(from, to), s:byte(from, to)) end
    say(s:sub(from), s:byte(from))
  end
  say(s:upper(), s:lower(), s:reverse(), s:len(), #s)
  for n = -1, 4 do say(s:rep(n), s:rep(n, '-')) end
end
for _, f in ipairs { '%d', '%5d', '%-5d|', '%05d', '%+d', '%x', '%X', '%o', '%c', '%i' } do
  for _, n in ipairs { 0, 1, 65, 1234 } do say(f, string.format(f, n)) end
end
for _, f in ipairs { '%g', '%.3f', '%10.2e', '%a', '%.0f', '%s', '%q', '%-8s|', '%.2s' } do
  for _, n in ipairs { 0, 0.5, -1.25, 1e300, 3 } do say(f, pcall(string.format, f, n)) end
end
say(string.format('%s %s %q %%', true, nil, 'a\n"b"\0'))
for _, text in ipairs { '0', '10', ' 0x1F ', '1e2', 'z', '7fffffff', '-12', '1.5', '', '0x', '1 2'
  } do
  say(text, tonumber(text), math.type(tonumber(text)))
  for base = 2, 36, 7 do say(tonumber(text, base)) end
end
for _, list in ipairs { {}, { 1 }, { 1, 2, 3, 4, 5 } } do
  say(#list, table.concat(list, ','), table.concat(list, '-', 1, #list), table.unpack(list))
  for at = 1, #list + 1 do
    local copy = table.move(list, 1, #list, 1, {})
    table.insert(copy, at, 'x')
    say(table.concat(copy, ' '), table.remove(copy, at), table.concat(copy, ' '),
      table.remove(copy), #copy)
    say(table.unpack(table.move(list, 1, #list, at, { 9, 9, 9 }), 1, 11))
    say(table.unpack(table.move({ 1, 2, 3, 4 }, 2, 4, at), 1, 11))
  end
  say(table.pack(table.unpack(list, 2, 4)).n, select('#', table.unpack(list, 1, 6)), select(-1, 1,
    2))
end
say(pcall(table.insert, { 1 }, 5, 1)); say((pcall(table.concat, { {} })))
for code = 0, 70000, 997 do say(code, #utf8.char(code), utf8.codepoint(utf8.char(code), 1, 1,
  true)) end
local word = 'a\u{E4}\u{20AC}\u{10348}z'
say(utf8.len(word), utf8.offset(word, 3), utf8.offset(word, -1), utf8.len('\xff'),
  utf8.charpattern)
for at, code in utf8.codes(word) do say(at, code) end
for _, x in ipairs { 0, 1, -1, 2.5, -2.5, 7, 1e15, -0.0 } do
  say(math.floor(x), math.ceil(x), math.abs(x), math.tointeger(x), math.max(x, 1), math.min(x, 1,
    -7))
  say(math.fmod(x, 3), math.modf(x), x // 2, x % 3, math.ult(1, 2), math.type(x))
end
local wrapped = coroutine.wrap(function(a, b)
  local c, d = coroutine.yield(a + b); local e = coroutine.yield(c * d); return e, 'end'
end)
say(wrapped(1, 2)); say(wrapped(3, 4)); say(wrapped(5)); say((pcall(wrapped)))
local thread = coroutine.create(function(...) say(...); error({ code = 3 }) end)
local ok, problem = coroutine.resume(thread, 1, nil, 3)
say(ok, problem.code, coroutine.status(thread), coroutine.isyieldable(),
  (coroutine.close(thread)))
say(xpcall(function(x) error('bad ' .. x, 0) end, function(e) return e .. '!' end, 7))
say(select('#', xpcall(function(...) return ... end, print, 1, nil, nil)), rawequal(out, out),
  rawlen(out) > 0)
local meta = setmetatable({}, { __index = function(_, k) return k .. k end, __len = function()
  return 42 end,
                                __call = function(_, a) return a end, __tostring = function()
                                  return 'M' end,
                                __name = 'N', __concat = function() return 'cat' end, __eq =
                                  rawequal })
say(meta.ab, #meta, meta(5), meta, meta .. 1, rawget(meta, 'ab'), getmetatable(meta).__name,
  next({}))
say(pcall(setmetatable, setmetatable({}, { __metatable = 'locked' }), {}))
)lua");
}
