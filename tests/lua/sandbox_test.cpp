// The sandbox: what a scene cannot reach, and attacks that never end the program.
#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

// A complete scene after some lines; it loads when the lines raise no error.
std::string with_scene(const std::string& lines) {
  return lines +
         "\nreturn sim.scene { state = {1}, field = sim.field.lua { function(t, x) return "
         "{-x[1]} end }, integrator = \"rk4\", dt = 0.1, duration = 1 }\n";
}

}  // namespace

TEST_CASE("a scene has no way out of the sandbox", "[lua][sandbox]") {
  const char* absent[] = {"os",       "io",     "debug",          "package",    "load",
                          "loadfile", "dofile", "collectgarbage", "loadstring", "string.dump"};
  for (const char* name : absent) {
    INFO(name);
    CHECK_NOTHROW(load_text(with_scene("assert(" + std::string(name) + " == nil)")));
  }
  CHECK_THROWS_AS(load_text(with_scene("assert(math == nil)")), Error);

  const SceneFolder folder;
  const std::string victim = (folder.path() / "victim").string();
  const std::string attempts[] = {
      "os.execute('touch " + victim + "')",
      "io.open('" + victim + "', 'w'):write('x')",
      "package.loadlib('" + victim + "', '*')",
      "debug.getregistry()",
      "getmetatable('').__index.dump(print)",
      "load(string.char(27) .. 'Lua')()",
      "require('" + victim + "')",
      "_G.io.open('" + victim + "', 'w')",
      "_ENV.os.remove('" + victim + "')",
  };
  for (const std::string& attempt : attempts) {
    INFO(attempt);
    const auto error = text_error(with_scene(attempt));
    REQUIRE(error);
    CHECK(error->kind() == ErrorKind::kScene);
    CHECK(error->text().where == "scene.lua:2");
    CHECK_FALSE(std::filesystem::exists(victim));
  }
}

TEST_CASE("the standard library that remains is usable", "[lua][sandbox]") {
  CHECK_NOTHROW(load_text(with_scene(
      "assert(string.format('%d', 3) == '3' and math.floor(2.5) == 2 and #table.pack(1, 2) == 2)\n"
      "assert(utf8.char(65) == 'A' and select('#', 1, 2) == 2 and pcall(error, 'x') == false)\n"
      "local co = coroutine.wrap(function() coroutine.yield(7) end)\n"
      "assert(co() == 7)")));
}

TEST_CASE("files are text only", "[lua][sandbox]") {
  const SceneFolder folder;
  const std::string bytecode = std::string("\x1bLua\x54\x00\x19\x93\r\n\x1a\n", 12);
  auto error = load_error(folder, folder.write("binary.lua", bytecode));
  REQUIRE(error);
  CHECK(error->kind() == ErrorKind::kScene);
  CHECK(contains(error->text().why, "binary chunk"));

  folder.write("part.lua", bytecode);
  error = load_error(folder, folder.write("scene.lua", "local part = require 'part'"));
  REQUIRE(error);
  CHECK(contains(error->text().why, "binary chunk"));
}

TEST_CASE("a file may start with a byte order mark or a # line", "[lua][sandbox]") {
  const SceneFolder folder;
  const std::string scene = with_scene("local sim = require 'sim'");
  CHECK_NOTHROW(load(folder.write("mark.lua", "\xEF\xBB\xBF" + scene)));
  CHECK_NOTHROW(load(folder.write("hash.lua", "#!/usr/bin/env sim\n" + scene)));
  const auto error = load_error(folder, folder.write("line.lua", "#!x\nerror('third')"));
  REQUIRE(error);
  CHECK(error->text().where == "line.lua:2");
}

TEST_CASE("require stays in its folders", "[lua][sandbox]") {
  const SceneFolder folder;
  folder.write("secret.lua", "return 1");
  folder.write("in/part.lua", "return { value = 5 }");
  folder.write("in/lib/init.lua", "return 6");
  folder.write("in/deep/er.lua", "return 7");
  folder.write("in/none.lua", "");
  const auto attempt = [&](const std::string& line) {
    return load_error(
        folder, folder.write("in/scene.lua", "local sim = require 'sim'\n" + with_scene(line)));
  };
  for (const char* good :
       {"assert(require('part').value == 5)", "assert(require('lib') == 6)",
        "assert(require('deep.er') == 7)", "assert(require('none') == true)",
        "assert(require('part') == require('part'))", "assert(require('sim') == sim)"}) {
    INFO(good);
    const auto error = attempt(good);
    INFO((error ? error->what() : ""));
    CHECK_FALSE(error);
  }
  for (const char* name : {"../secret", "..secret", "..", ".", "", ".secret", "secret.", "a..b",
                           "/etc/passwd", ".etc.passwd", "part\\0x", "part%", "in/part", "p art"}) {
    INFO(name);
    const auto error = attempt("require \"" + std::string(name) + "\"");
    REQUIRE(error);
    CHECK(error->kind() == ErrorKind::kScene);
    CHECK(error->text().where == "in/scene.lua:2");
    CHECK(contains(error->text().what, "bad module name"));
  }
  const auto error = attempt("require 'prt'");
  REQUIRE(error);
  CHECK(error->text().what == "module 'prt' not found");
  CHECK(contains(error->text().why, "in/prt.lua"));
}

TEST_CASE("files that require each other in a circle are an error", "[lua][sandbox]") {
  const SceneFolder folder;
  folder.write("a.lua", "\nreturn require 'b' + 1");
  folder.write("b.lua", "\n\nlocal a = require 'a'\nreturn a");
  const auto error = load_error(folder, (folder.path() / "a.lua").string());
  REQUIRE(error);
  CHECK(error->text().what == "cyclic require");
  CHECK(error->text().where == "b.lua:3");
}

TEST_CASE("a scene's folder cannot replace the scene language", "[lua][sandbox]") {
  const SceneFolder folder;
  folder.write("sim.lua", "return { scene = 'fake' }");
  CHECK_NOTHROW(load(folder.write("scene.lua", with_scene("local sim = require 'sim'"))));
}

TEST_CASE("runaway code ends in an error", "[lua][sandbox]") {
  const struct {
    const char* code;
    const char* why;
  } cases[] = {
      {"local function f() return 1 + f() end f()", "stack overflow"},
      {"local t = setmetatable({}, {__index = function(t, k) return t[k] end}) local x = t.x",
       "C stack overflow"},
      {"local function f(s) return (string.gsub(s, '.', f)) end f('x')", "C stack overflow"},
      {"local s = '' s = s:rep(1 << 62, 'abc')", "too large"},
      {"error({})", "error object is a table value"},
      {"error(nil)", "error object is a nil value"},
      {"error(setmetatable({}, {__tostring = error}))", "error object is a table value"},
      {"error(coroutine.create(print))", "error object is a thread value"},
      {"error('two\\nlines\\27[31m')", "two lines\\x1b[31m"},
      {"coroutine.yield(1)", "outside a coroutine"},
      {"string.format('%d', 'x')", "number expected"},
      {"table.concat({}, 'x', 1, 3)", "invalid value"},
      {"setmetatable(_G, nil)", "protected metatable"},
      {"coroutine.wrap(function() error('inside') end)()", "inside"},
  };
  for (const auto& [code, why] : cases) {
    INFO(code);
    const auto error = text_error(code);
    REQUIRE(error);
    INFO(error->what());
    CHECK(error->kind() == ErrorKind::kScene);
    CHECK(error->text().where == "scene.lua:2");
    CHECK(contains(error->text().why, why));
    CHECK(std::string(error->what()).find_first_of("\n\x1b") == std::string::npos);
  }
}

TEST_CASE("an error that a scene caught, changed and raised again stays a scene error",
          "[lua][sandbox]") {
  const auto error = text_error(
      "local ok, e = pcall(function() return sim.nothing end)\n"
      "assert(not ok and tostring(e):find('sim.nothing', 1, true))\n"
      "e.kind = 77\ne.why = 'two\\nlines\\27'\ne.remedy = {}\nerror(e)");
  REQUIRE(error);
  CHECK(error->kind() == ErrorKind::kScene);
  CHECK(error->text().where == "scene.lua:2");
  CHECK(error->text().why == "two lines\\x1b");
  CHECK(error->text().remedy.empty());
}

TEST_CASE("memory has a limit", "[lua][sandbox]") {
  const SceneFolder folder;
  Registry registry({SIM_PLUGIN_DIR});
  const struct {
    const char *line, *what;
  } cases[] = {
      {"local t = {} for i = 1, 1e7 do t[i] = {} end", "out of memory"},
      {"local s = string.rep('x', 10000000)", "out of memory"},
      {"pcall(string.rep, 'x', 10000000) error('goes on')", "out of memory"},
  };
  for (const auto& [line, what] : cases) {
    INFO(line);
    const std::string file = folder.write("scene.lua", line);
    try {
      load_scene(file, registry, {search_path(), {}, 0, {.memory = 4'000'000}});
      FAIL("no error");
    } catch (const Error& error) {
      CHECK(error.kind() == ErrorKind::kScene);
      CHECK(contains(error.text().where, file));
      CHECK(error.text().what == what);
    }
  }
}

TEST_CASE("deep nesting in the source or the tables is an error or harmless", "[lua][sandbox]") {
  std::string deep(100000, '{');
  auto error = text_error("local t = " + deep);
  REQUIRE(error);
  CHECK(error->text().what == "Lua syntax error");

  error = text_error(
      "local t = {1} for i = 1, 200000 do t = {t} end\n"
      "return sim.scene { state = t, field = sim.field.rotation {}, integrator = 'rk4', dt = 1, "
      "duration = 1 }");
  REQUIRE(error);
  CHECK(contains(error->text().what, "state"));

  error = text_error(
      "local t = {} t.t = t\nlocal f = sim.force.gravity { g = t }\n"
      "local particles = sim.particles {} particles:add {0, 0, 0}\n"
      "local forces = { f }\n" +
      kEnd);
  REQUIRE(error);
  CHECK(error->text().where == "scene.lua:3");
}

TEST_CASE("a syntax error names its line, also in a long path", "[lua][sandbox]") {
  const SceneFolder folder;
  for (const std::string& name : {std::string("short"), std::string(100, 'n')}) {
    const auto error = load_error(folder, folder.write(name + ".lua", "local x\nlocal y = = 2\n"));
    REQUIRE(error);
    CHECK(error->text().what == "Lua syntax error");
    CHECK(error->text().where == name + ".lua:2");
    CHECK(error->text().why == "unexpected symbol near '='");

    const auto raised = load_error(folder, folder.write(name + ".lua", "\n\nerror 'here'"));
    REQUIRE(raised);
    CHECK(raised->text().where == name + ".lua:3");
    CHECK(raised->text().why == "here");
  }
}

TEST_CASE("runs are repeatable: math.random and pairs", "[lua][sandbox]") {
  const std::string text =
      "local particles = sim.particles {}\n"
      "math.randomseed()\n"
      "particles:add { math.random(), math.random(), math.random(1, 1000000) }\n"
      "local order = {}\n"
      "for key in pairs { gamma = 1, alpha = 2, [2.5] = 3, 'first', beta = 4, [-3] = 5 } do\n"
      "  order[#order + 1] = tostring(key)\n"
      "end\n"
      "assert(table.concat(order, ' ') == '-3 1 2.5 alpha beta gamma', table.concat(order, ' '))\n"
      "local forces = {}\n" +
      kEnd;
  const Vec3 first = load_text(text, {}, 5).systems[0].particles->at(0).position;
  CHECK(load_text(text, {}, 5).systems[0].particles->at(0).position == first);
  CHECK(load_text(text, {}, 6).systems[0].particles->at(0).position != first);
}

TEST_CASE("pairs survives changes to the table it visits", "[lua][sandbox]") {
  CHECK_NOTHROW(load_text(with_scene(
      "local t, seen = { a = 1, b = 2, c = 3 }, ''\n"
      "for key, value in pairs(t) do seen = seen .. key .. value t[key] = nil t.b = nil end\n"
      "assert(seen == 'a1c3', seen)\n"
      "local p = setmetatable({}, { __pairs = function() return next, { x = 1 }, nil end })\n"
      "for key in pairs(p) do seen = key end\n"
      "assert(seen == 'x')")));
}
