// A scene has the same bits in every process, whatever it makes of addresses and orders.
#include <catch2/catch.hpp>

#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

// A particle whose place follows from the text that the code leaves in `text`.
std::string scene_of(const std::string& code) {
  return "local sim = require 'sim'\nlocal text = ''\n" + code +
         "\nlocal number = 0\n"
         "for i = 1, #text do number = (31 * number + text:byte(i)) % 1000003 end\n"
         "local p = sim.particles { mass = 1 }\np:add { number, 0, 0 }\n"
         "return sim.scene { particles = p, forces = {}, integrator = 'rk4', dt = 0.01, duration = "
         "0.01 }\n";
}

std::string hash_of(const std::string& file) {
  const Outcome outcome = run_sim({file, "-n", "0"});
  CHECK(outcome.code == 0);
  const std::size_t at = outcome.out.find("hash ");
  REQUIRE(at != std::string::npos);
  return outcome.out.substr(at, 30);
}

}  // namespace

TEST_CASE("addresses and orders of a process do not reach the bits of a scene", "[cli][lua]") {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "scene.lua").string();
  for (const std::string code :
       {"text = tostring({}) .. tostring(function() end) .. tostring(coroutine.create(print))",
        "text = tostring(print) .. tostring(math.floor) .. tostring(string.find)",
        "text = tostring(setmetatable({}, { __name = 'thing' }))",
        "text = ('%p %10p %s %-20s'):format({}, print, {}, next)",
        "text = ('%p %p'):format('a', ('long'):rep(50))",
        "for k in next, { alpha = 1, beta = 2, gamma = 3, delta = 4, epsilon = 5 } do text = text "
        ".. "
        "k end",
        "local t = {} for i = 1, 50 do t['k' .. i] = i end\n"
        "local k = next(t) while k do text = text .. k k = next(t, k) end",
        "local t = {} for i = 1, 50 do t[{ i }] = i t[function() return i end] = -i end\n"
        "for k, v in pairs(t) do text = text .. v .. ' ' end",
        "local t = { [print] = 1, [pairs] = 2, [math.sin] = 3, [math.cos] = 4, [true] = 5 }\n"
        "for k, v in pairs(t) do text = text .. v end\nfor k, v in next, t do text = text .. v end",
        "local t = {} for i = 1, 3000 do t[i] = { i * i % 7, i } end\n"
        "table.sort(t, function(a, b) return a[1] < b[1] end)\n"
        "for i = 1, 3000 do text = text .. t[i][2] % 10 end",
        "local t = {} for i = 1, 5000 do t[i] = i % 2 == 0 and i or 0.0 end\n"
        "t = table.move(t, 1, 5000, 3000) for i = 1, #t do t[i] = t[i] or 1 end\n"
        "table.sort(t, function(a, b) return a // 1000 < b // 1000 end)\n"
        "for i = 1, #t, 7 do text = text .. t[i] end",
        "local ok, e = pcall(table.sort, { 3, 1, 2, 0 / 0, 5, 0 / 0, 4 })\ntext = tostring(e)",
        "local ok, e = pcall(error, {})\ntext = tostring(e)",
        "math.randomseed() text = math.random(1, 1000000) .. ''"}) {
    INFO(code);
    write_text(file, scene_of(code));
    const std::string first = hash_of(file);
    for (int again = 0; again < 3; ++again) CHECK(hash_of(file) == first);
  }
}

TEST_CASE("next goes in the order of pairs, and is told when it is asked for no key",
          "[cli][lua]") {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "scene.lua").string();
  write_text(file,
             scene_of("local t = { 3, 1, x = 1, b = 2, [2.5] = 3, [-1] = 4, [true] = 5, [{}] "
                      "= 6 }\n"
                      "local a, b = '', ''\n"
                      "for k, v in pairs(t) do a = a .. tostring(k) .. v end\n"
                      "for k, v in next, t do b = b .. tostring(k) .. v end\n"
                      "assert(a == b, a .. ' ' .. b)\n"
                      // Two tables at once, one of which loses its entries.
                      "local seen = 0\nfor k in next, t do for j in next, { 1, 2, 3 } do "
                      "seen = seen + j end t[k] = nil end\n"
                      "assert(seen == 48 and next(t) == nil, seen)\n"
                      "assert(not pcall(next, {}, 'no key'))\n"
                      // Many tables at once.
                      "local function deep(n) local s = 0 for k in next, { 1, 2 } do s = s + "
                      "(n > 0 and deep(n - 1) or k) end return s end\n"
                      "assert(deep(11) == 3 * 2 ^ 11)\n"
                      // An empty list is seen at once, and a long one is gone through quickly.
                      "local long = {} for i = 1, 20000 do long['k' .. i] = i end\n"
                      "local sum = 0 for k, v in next, long do sum = sum + v end\n"
                      "assert(sum == 20000 * 20001 / 2)\n"));
  const Outcome outcome = run_sim({file, "-n", "0"});
  CHECK(outcome.err.find("error") == std::string::npos);
  CHECK(outcome.code == 0);
}
