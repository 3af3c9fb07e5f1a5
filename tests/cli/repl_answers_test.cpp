// Answers of a prompt about a scene, and the record of a session.
#include <catch2/catch.hpp>
#include <csignal>

#include "tests/cli/program.h"
#include "tests/cli/terminal.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

Outcome session(const std::string& input, std::vector<std::string> arguments = {},
                const std::filesystem::path& folder = {}) {
  return run_sim(arguments, {.program = SIM_REPL_BINARY, .input = input, .folder = folder});
}

std::string output(const std::string& input, std::vector<std::string> arguments = {},
                   const std::filesystem::path& folder = {}) {
  const Outcome outcome = session(input, std::move(arguments), folder);
  INFO(input << outcome.err);
  CHECK(outcome.code == 0);
  return outcome.out;
}

bool says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("repl: how many, how heavy, which are held, with which parameters") {
  CHECK(output("n()\nmass(12)\n.mass 12\npins()\nargs().n\nargs().structural\n") ==
        "64\n0.015625\n0.015625\n{0, 7}\n8\n100\n");
  CHECK(output(".pin 3\n.unpin 0\n.pins\n") == "{3, 7}\n");
  CHECK(output("n()\n", {"scenes/circle.lua"}) == "1\n");
  CHECK(session("mass(0)\n", {"scenes/circle.lua"}).code == 2);
}

TEST_CASE("repl: springs with their strain and force") {
  const std::string text = output(".set_position 12 0.5 -0.1 0.125\n.springs 12\n");
  for (const char* word : {"structural", "strain", "force [N]", "k 100 N/m"})
    CHECK(says(text, word));
  CHECK(
      output(
          "set_position(12, {0.5, 0, 0.15})\n"
          "for _, s in ipairs(springs(12)) do\n"
          "  if s.to == 4 then print(string.format('%.6f %.6f', s.strain, s.force)) end\nend\n") ==
      "0.200000 2.500000\n");
}

TEST_CASE("repl: the verdict on the last run, with its span") {
  CHECK(output(".verdict\n") == "there was no run yet: .run makes one\n");
  const std::string text = output(".run 0.5\n.run 0.25\n.verdict\n");
  CHECK(text.rfind("trusted: positions to ", 0) == 0);
  CHECK(says(text, "of the run from t = 0.5 s to 0.75 s\n"));
  CHECK(output("run(0.5)\nverdict().verdict\n") == "\"trusted\"\n");
}

TEST_CASE("repl: steps one by one are judged as one run, and take no longer") {
  std::string steps;
  for (int i = 0; i < 8000; ++i) steps += ".step 1\n";
  const std::string apart = output(steps + ".verdict\n.hash\n");
  CHECK(apart == output(".step 8000\n.verdict\n.hash\n"));
  CHECK(says(apart, "trusted"));
  CHECK(says(apart, "from t = 0 s to 40 s"));
  // A change between them, a step back and an error do not lose the verdict on what came before.
  const std::string touched = output(
      ".step 1\n.step 9\n.pin 3\n.verdict\n.back 5\n.step 2\n"
      ".verdict\n");
  CHECK(says(touched, "from t = 0 s to 0.05 s"));
  // Euler's method is caught when it is asked, and at once where a step fails.
  CHECK(says(output(".integrator euler\n.step 3\n.step 30\n.verdict\n"), "suspect"));
  CHECK(session(".integrator euler\n.step 100\n" + steps).code == 4);
}

TEST_CASE("repl: the studies, of the scene as it is set") {
  const std::string stable = output(".set n 4\n.stability rk4\n");
  CHECK(says(stable, "rk4"));
  CHECK(says(stable, "rad/s"));
  CHECK(says(output(".order rk4\n", {"scenes/circle.lua"}), "rk4"));
  CHECK(says(output(".tradeoff 1%\n", {"scenes/circle.lua"}), "rk4"));
  CHECK(session(".tradeoff much\n").code == 2);
  CHECK(says(output(".minimal 1%\n", {"scenes/circle.lua"}), "smallest scene within the budget"));
  CHECK(session(".minimal much\n").code == 2);
}

TEST_CASE("repl: a step beyond the limit is warned of when it is set") {
  CHECK(session(".dt 0.005\n").err.empty());
  const Outcome warned = session(".dt 0.05\n");
  CHECK(warned.code == 0);
  CHECK(warned.err.rfind("sim: warning: dt is ", 0) == 0);
  CHECK(says(warned.err, " % of the largest stable one, about 0.01"));
  CHECK(says(session(".integrator euler\n").err, "warning"));
}

TEST_CASE("repl: records and plots") {
  const TemporaryFolder folder;
  const std::string text = output(
      ".record low position(60)[2] every 20\n.record e energy().total\n.run 0.5\n.record\n"
      "#record('low'), record('low')[1].value, record('low')[6].t\n#record('e')\n"
      ".plot low\n.plot low low.svg\n",
      {}, folder.path());
  CHECK(says(text, "low  position(60)[2]  every 20 steps  6 values\n"));
  CHECK(says(text, "\n6\n0.0\n0.5\n101\n"));
  CHECK(says(text, "t = 0.5 s\n"));
  for (const std::string& line : lines_of(text)) CHECK(line.size() <= 80);
  CHECK(read_text(folder.path() / "low.svg").rfind("<svg ", 0) == 0);
  // Going back and on again replaces what came after.
  CHECK(output(".record t t() every 10\n.step 100\n.back 50\n.step 20\n#record('t')\n"
               "record('t')[8].t\n") == "8\n0.35000000000000003\n");
  CHECK(output(".record t t()\n.record t off\n.step 9\n.record\n") == "nothing is recorded\n");
  // In Lua, with a function; the run is the same.
  CHECK(output("record('y', function() return position(60)[2] end, "
               "5)\nstep(400)\n#record('y')\n.hash\n") == "81\n129f25ebe3e79c14\n");
  CHECK(session(".record x position(1)\n").code == 2);
  CHECK(session(".record x set_velocity(1, {0, 0, 0})\n").code != 0);
  // One that fails later ends, and the run goes on.
  const Outcome ended =
      session(".record sag position(60)[2]\n.open scenes/pendulum1.lua\n.step 9\ntaken()\n");
  CHECK(ended.out == "9\n");
  CHECK(says(ended.err, "sim: warning: record 'sag' ended: there is no particle 60"));
  CHECK(session(".plot nothing\n").code == 2);
  CHECK(session(".record x t() every 0\n").code == 2);
}

TEST_CASE("repl: the scene is drawn as it is now") {
  const TemporaryFolder folder;
  output(".show a.png\n.step 50\n.show b.png\n.show b.ply\n", {}, folder.path());
  const std::string start = read_text(folder.path() / "a.png"),
                    later = read_text(folder.path() / "b.png");
  CHECK(start.size() > 10'000);
  CHECK(start != later);
  CHECK(read_text(folder.path() / "b.ply").rfind("ply\n", 0) == 0);
  CHECK(says(session(".show\n").err, "give a file"));  // a pipe is no terminal
  CHECK(says(session(".show a.xxx\n").err, "nothing writes .xxx"));
}

TEST_CASE("repl: changes are taken back one by one, and t stays") {
  const std::string start = output(".step 9\n.hash\n");
  CHECK(output(".step 9\n.set_velocity 9 1 0 0\n.set_velocity 10 1 0 0\n.undo\n.undo\n.hash\n") ==
        start);
  CHECK(output(".step 9\n.set_velocity 9 1 0 0\n.hash\n.set_velocity 10 1 0 0\n.undo\n.hash\n") ==
        output(".step 9\n.set_velocity 9 1 0 0\n.hash\n.hash\n"));
  // One line of Lua is one change.
  CHECK(output(".step 9\nfor i = 9, 12 do set_velocity(i, {1, 0, 0}) end\n.undo\n.hash\n") ==
        start);
  CHECK(output(".step 100\n.dt 0.01\n.step 100\nt()\n.undo\nt()\ntaken()\n") == "1.5\n1.5\n300\n");
}

TEST_CASE("repl: branches keep the scene that they know") {
  CHECK(output(".run 0.1\n.hash\n.branch kept\n.set n 6\nn()\n.switch kept\nn()\nargs().n\n.hash\n"
               ".switch main\nn()\n")
            .find("36\n64\n8\n") != std::string::npos);
  const Outcome outcome = session(".branch kept\n.set n 6\n.diff kept\n");
  CHECK(outcome.code == 2);
  CHECK(says(outcome.err, "their scenes have other systems or sizes"));
  CHECK(says(output(".branch kept\n.set flex 20\n.step 3\n.switch kept\n.step 3\n.diff main\n"),
             "first difference at step "));
}

TEST_CASE("repl: another scene, another library") {
  CHECK(output(".run 0.1\n.open scenes/pendulum1.lua\nn()\nt()\n") == "2\n0.0\n");
  CHECK(session(".open nowhere.lua\n").code == 5);
  const std::string library = std::string(SIM_FIXTURE_DIR) + "/ralston/ralston.so";
  CHECK(output(".load " + library + "\n.integrator ralston\n.integrator\n") == "ralston\n");
  CHECK(session(".load nothing.so\n").code != 0);
}

TEST_CASE("repl: a session is saved as commands that replay it") {
  const TemporaryFolder folder;
  const std::string out = output(
      ".run 0.2\nfor i = 9, 12 do\n  set_velocity(i, {0, 0, 1})\nend\n.dt 0.002\nn()\n"
      ".integrator verlet\n.run 0.1\n.branch b\n.back 10\n.save again.sim\n.hash\n",
      {"scenes/cloth.lua", "-s", "n=6", "-d", "0.004"}, folder.path());
  const std::string hash = out.substr(out.size() - 17);
  const std::string script = read_text(folder.path() / "again.sim");
  for (const char* line : {"\n.open scenes/cloth.lua\n.set n 6\n.dt 0.004\n", "\n.run 0.2\n",
                           "\n  set_velocity(i, {0, 0, 1})\nend\n"})
    CHECK(says(script, line));
  CHECK_FALSE(says(script, ".save"));
  const Outcome again = run_sim({"-f", "again.sim", "-e", ".hash"},
                                {.program = SIM_REPL_BINARY, .folder = folder.path()});
  INFO(again.err);
  CHECK(again.code == 0);
  CHECK(again.out.substr(again.out.size() - 17) == hash);
}

TEST_CASE("repl: a local that is gone, and a command without its dot, explain themselves") {
  for (const char* line : {"q", "q + 1", "print(q)"}) {
    const Outcome outcome = session("local q = 3\n" + std::string(line) + "\n");
    CHECK(says(outcome.err, "unknown name 'q'"));
    CHECK(says(outcome.err, "it was local to the line that made it; leave out 'local'"));
  }
  CHECK(says(session("w\n").err, "give it a value first: w = 1"));
  CHECK(session("local q = 3\nq = 4\nq\n").err.empty());
  CHECK(says(session("step 10\n").err, "; write .step 10 or step(10)\n"));
  CHECK(says(session("set n 4\n").err, "; write .set n 4\n"));
}

TEST_CASE("repl: lines for the start, at a terminal or when asked for") {
  const TemporaryFolder folder;
  write_text(folder.path() / "my.lua", "function twice(x) return 2 * x end\n");
  const std::vector<std::pair<std::string, std::string>> home = {
      {"SIM_INIT", (folder.path() / "my.lua").string()}};
  const Outcome piped =
      run_sim({}, {.program = SIM_REPL_BINARY, .input = "twice(4)\n", .environment = home});
  CHECK(piped.code == 3);
  CHECK(output("twice(4)\n", {"--init", (folder.path() / "my.lua").string()}) == "8\n");
  CHECK(session("1\n", {"--init", "nothing.lua"}).code == 5);

  setenv("SIM_INIT", home[0].second.c_str(), 1);
  PlainTerminal terminal(SIM_REPL_BINARY, {"scenes/circle.lua"}, folder.path().string());
  terminal.wait_for("circle 0 s> ");
  terminal.type("twice(21)\r");
  CHECK(says(terminal.wait_for("circle 0 s> "), "42\n"));
  unsetenv("SIM_INIT");
}

TEST_CASE("signals end Lua fields, and what cannot be stopped") {
  const TemporaryFolder folder;
  write_text(folder.path() / "f.lua",
             "local sim = require 'sim'\nreturn sim.scene { name = 'f', state = { 1 }, dt = 0.1,\n"
             "  integrator = 'rk4', duration = 1, field = sim.field.lua { function(t, x)\n"
             "    while t > 0.1 do end return { -x[1] } end } }\n");
  const Outcome run =
      run_sim({"f.lua", "--every", "1"},
              {.folder = folder.path(), .signal = SIGINT, .signal_at = "\n        1 "});
  INFO(run.err);
  CHECK(run.code == 130);
  CHECK(says(run.err, "interrupted at t = 0.1 s"));
  // At the prompt the field as well; and a pattern that takes for ever ends with the program.
  CHECK(run_sim({(folder.path() / "f.lua").string()}, {.program = SIM_REPL_BINARY,
                                                       .input = "print('go')\nrun(1)\n",
                                                       .signal = SIGINT,
                                                       .signal_at = "go"})
            .code == 130);
  CHECK(run_sim({}, {.program = SIM_REPL_BINARY,
                     .input = "print('go')\nstring.find(string.rep('a', 60), string.rep('a*', 60) "
                              ".. 'b')\n",
                     .signal = SIGTERM,
                     .signal_at = "go"})
            .code == 143);
}
