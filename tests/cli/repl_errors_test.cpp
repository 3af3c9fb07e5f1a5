// Errors in a session: the exit code, the location, and the state that is left.
#include <catch2/catch.hpp>
#include <random>

#include "tests/cli/program.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

Outcome session(const std::string& input, std::vector<std::string> arguments = {}) {
  return run_sim(arguments, {.program = SIM_REPL_BINARY, .input = input});
}

struct Failure {
  std::string input;
  int code;
  std::string error;  // how the first line begins
};

}  // namespace

TEST_CASE("repl: the first error ends a script with its code and its line") {
  const Failure failures[] = {
      {"1\n.stpe\n2\n", 2,
       "sim: error: unknown command '.stpe': stdin:2: there is none of that "
       "name; did you mean '.step'?"},
      {".s\n", 2,
       "sim: error: unclear command '.s': stdin:1: it is short for more than one; say "
       ".step, .switch, "},
      {".step -1\n", 2,
       "sim: error: bad use of .step: stdin:1: expected a number of steps, a whole "
       "number from 0 on, got -1; write .step [N]"},
      {".step 1 2\n", 2, "sim: error: bad use of .step: stdin:1: it takes 1 argument; write .step"},
      {".step 1.5\n", 2, "sim: error: bad use of .step: stdin:1"},
      {".step x\n", 2, "sim: error: bad use of .step: stdin:1"},
      {".run nan\n", 2, "sim: error: bad use of .run: stdin:1"},
      {".run 1e300\n", 2, "sim: error: too many steps: stdin:1"},
      {".goto 1e300\n", 2, "sim: error: too many steps: stdin:1"},
      {".goto -1\n", 2, "sim: error: bad use of .goto: stdin:1"},
      {".integrator rk4 precision\n", 2,
       "sim: error: bad use of .integrator: stdin:1: expected PARAM=VALUE, got \"precision\""},
      {".integrator rk4 =single\n", 2,
       "sim: error: bad use of .integrator: stdin:1: expected PARAM=VALUE, got \"=single\""},
      {".back\n", 2, "sim: error: cannot go back 1 step: stdin:1: 0 steps have been taken; .reset"},
      {".dt 0\n", 2, "sim: error: bad step size: stdin:1: dt is 0; give a number of seconds > 0"},
      {".integrator rk5\n", 2,
       "sim: error: unknown integrator 'rk5': stdin:1: no plugin has that "
       "name; did you mean 'rk"},
      {".integrator verlet:tol=1\n", 2, "sim: error: integrator 'verlet': stdin:1: it has no "},
      {".position 64\n", 2,
       "sim: error: bad use of .position: stdin:1: there is no particle 64: "
       "ids run from 0 to 63"},
      {".set_velocity 0 1 1 1\n", 2,
       "sim: error: no velocity to set: stdin:1: particle 0 is pinned"},
      {".set_velocity 1 1 1\n", 2, "sim: error: bad use of .set_velocity: stdin:1"},
      {".pin 1 99\n", 2, "sim: error: bad use of .pin: stdin:1: there is no particle 99"},
      {".springs\n", 2, "sim: error: bad use of .springs: stdin:1"},
      {".switch no\n", 2, "sim: error: unknown branch 'no': stdin:1"},
      {".system no\n", 2, "sim: error: unknown system 'no': stdin:1"},
      {".set m 1\n", 2, "sim: error: unknown parameter 'm': stdin:1: --set m=1: "},
      {".set n x\n", 2, "sim: error: bad value 'x': stdin:1: --set n: expected a number"},
      {".mode xml\n", 2, "sim: error: bad use of .mode: stdin:1: expected text, json or csv"},
      {".dump x.txt\n", 2, "sim: error: unknown table format: stdin:1: .dump=x.txt"},
      {".dump /nowhere/x.csv\n", 5, "sim: error: cannot write: stdin:1: /nowhere/x.csv"},
      {".read /nowhere\n", 5, "sim: error: cannot read: stdin:1: /nowhere: No such file"},
      {"nothing?\n", 2, "sim: error: no help on 'nothing': stdin:1"},
      {".undo\n", 2, "sim: error: bad use of .undo: stdin:1: there is no change to take back"},
      {".dump \"a\n", 2, "sim: error: open quotes: stdin:1"},
      {".until energy(\n", 3, "sim: error: Lua syntax error: stdin:1: "},
      {".until false\n", 8,
       "sim: error: the condition did not hold: stdin:1: the run was given up "
       "after 200 s"},
      {"\n\nx = = 1\n", 3, "sim: error: Lua syntax error: stdin:3: "},
      {"x = {\n1,\n", 3, "sim: error: Lua syntax error: stdin:2: "},
      {"if true then\nerror(\"boom\")\nend\n", 3, "sim: error: Lua error: stdin:2: boom"},
      {"function f()\n  return nil + 1\nend\nx = 1\nf()\n", 3,
       "sim: error: Lua error: stdin:2: attempt to perform arithmetic on a nil value"},
      {"stpe(1)\n", 3,
       "sim: error: unknown name 'stpe': stdin:1: no such local or global; did you "
       "mean 'step'?"},
      {"sim.stpe(1)\n", 3,
       "sim: error: unknown name 'sim.stpe': stdin:1: neither the scene "
       "language nor the prompt has it; did you mean 'sim.step'?"},
      {"sim.particle{}\n", 3, "sim: error: unknown name 'sim.particle': stdin:1"},
      {"step(\"x\")\n", 2,
       "sim: error: bad use of sim.step: stdin:1: expected a number of steps, a "
       "whole number from 0 on, got \"x\"; see sim.help(\"step\")"},
      {"pcall(step, -1)\nlocal ok, e = pcall(step, -1) error(e)\n", 2,
       "sim: error: bad use of sim.step: stdin:2"},
      {"io.open(\"x\")\n", 3, "sim: error: Lua error: stdin:1: attempt to index a nil value"},
      {".dt 0.1\nstep(1000)\n", 4, "sim: error: diverged: stdin:2: "},
      {".dt 0.1\n.step 1000\n", 4, "sim: error: diverged: stdin:2: "},
      {".time\n", 2, "sim: error: bad use of .time: stdin:1"},
  };
  for (const Failure& failure : failures) {
    INFO(failure.input);
    const Outcome outcome = session(failure.input);
    CHECK(outcome.code == failure.code);
    INFO(outcome.err);
    const std::size_t begin = outcome.err.find("sim: error: ");  // after warnings
    REQUIRE(begin != std::string::npos);
    CHECK(outcome.err.substr(begin, failure.error.size()) == failure.error);
  }
}

TEST_CASE("repl: the condition of a run may look but not touch") {
  for (const char* touch : {"step()", "run(1)", "reset()", "back()", "goto_time(0)", "undo()",
                            "dt(1)", "pin(3)", "set(\"n\", 4)", "reload()", "integrator(\"rk4\")",
                            "branch(\"b\")", "switch(\"main\")", "run_until(t)"}) {
    INFO(touch);
    const Outcome outcome =
        session(std::string(".step 3\nrun_until(function() ") + touch + " end)\n");
    CHECK(outcome.code == 2);
    CHECK(outcome.err.starts_with("sim: error: a run is going on: stdin:2"));
    CHECK(session(std::string(".step\n.branch a\nok = pcall(run_until, function() ") + touch +
                  " end)\nstep(2)\ntaken()\n")
              .out == "3\n");
  }
}

TEST_CASE("repl: the place in a file that is read") {
  TemporaryFolder folder;
  const std::string file = (folder.path() / "a.lua").string();
  write_text(file, ".step\n\nfunction f()\n  error(\"boom\")\nend\nf()\n");
  const std::string error = "sim: error: Lua error: " + file + ":4: boom\n";
  CHECK(session("", {"-f", file}).err == error);
  CHECK(session("1\n.read " + file + "\n").code == 3);
  CHECK(session("1\nread(\"" + file + "\")\n").err == error);
  CHECK(session("1\n.read " + file + "\n").err ==
        "sim: error: Lua error: stdin:2: " + file + ":4: boom\n");
  write_text(file, ".read " + file + "\n");
  const Outcome outcome = session("", {"-f", file});
  CHECK(outcome.code == 2);
  CHECK(outcome.err.find("the files read each other") != std::string::npos);
  CHECK(session("", {"-e", "\n\nerror(\"x\")"}).err == "sim: error: Lua error: -e:3: x\n");
}

TEST_CASE("repl: a command that fails leaves the state as it was") {
  const std::string steps = ".integrator verlet\n.dt 0.001\n.step 50\n";
  const std::string hash = session(steps + ".hash\n.energy\n").out;
  for (const char* bad : {"set, \"n\", \"x\"",
                          "set, \"nope\", 1",
                          "integrator, \"rk5\"",
                          "integrator, \"rk4\", \"precision\"",
                          "integrator, \"rk4\", \"=single\"",
                          "integrator, \"rk4\", \"precision=none\"",
                          "dt, -1",
                          "dt, 1e400",
                          "set_velocity, 0, {1, 1, 1}",
                          "set_velocity, 12, {1, 1}",
                          "set_position, 12, {1, 1, 0/0}",
                          "pin, 3, 99",
                          "goto_time, -1",
                          "back, 51",
                          "switch, \"x\"",
                          "branch, \"main\"",
                          "resume, \"/nowhere\"",
                          "snap, \"/nowhere/x\"",
                          "dump, \"/nowhere/x.csv\"",
                          "read, \"/no\"",
                          "springs, -1",
                          "mode, \"xml\"",
                          "undo, 1",
                          "step, -1",
                          "integrator, \"dopri5\", {tol = -1}"}) {
    INFO(bad);
    const Outcome outcome = session(steps + "ok, why = pcall(" + bad +
                                    ")\nif ok then error(\"fine\") end\n"
                                    ".hash\n.energy\n");
    CHECK(outcome.code == 0);
    CHECK(outcome.out == hash);
    CHECK(session(steps + "pcall(" + bad + ")\n.undo\n.undo\n.integrator\n").code == 0);
    CHECK(session(steps + "pcall(" + bad + ")\n.undo\n.undo\n.undo\n").code == 2);
  }
}

TEST_CASE("repl: a diverging run keeps the last good state, and one can go back from there") {
  const Outcome outcome = session(
      ".integrator euler\n.dt 0.05\nok, why = pcall(step, 10000)\nok\n"
      "n = taken()\nn > 10\nposition(12)[1] == position(12)[1]\n"
      ".back 5\ntaken() == n - 5\n");
  CHECK(outcome.code == 0);
  CHECK(outcome.out == "false\ntrue\ntrue\ntrue\n");
}

TEST_CASE("repl: the command line is checked before anything is read") {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"--frob"},
                                             {"-d", "0"},
                                             {"-d", "nan"},
                                             {"-j", "0"},
                                             {"--history", "0"},
                                             {"--mode", "xml"},
                                             {"a", "b", "c", "d"},
                                             {"a", "rk4", "-i", "rk4"},
                                             {"--set", "x"},
                                             {"--seed", "-1"},
                                             {"--tol", "0"},
                                             {"-i", "rk5"}}) {
    INFO(arguments.front());
    const Outcome outcome = session("print(1)\n", arguments);
    CHECK(outcome.code == 2);
    CHECK(outcome.out == "");
    CHECK(outcome.err.starts_with("sim: error: "));
  }
  CHECK(session("", {"nowhere"}).code == 5);
  CHECK(session("", {"--plugin-path", "/nowhere"}).code == 5);
  const std::vector<std::string> help = lines_of(session("", {"--help"}).out);
  CHECK(help.front().starts_with("simrepl "));
  for (const std::string& line : help) CHECK(line.size() <= 80);
  for (const std::string& line : lines_of(session("?\n").out)) CHECK(line.size() <= 80);
  CHECK(session("", {"--version"}).out.starts_with("sim "));
  CHECK(session("1\n", {"scenes/circle.lua", "rk4", "0.001"}).out == "1\n");
}

TEST_CASE("repl: any bytes end with an error, not with a crash") {
  std::minstd_rand random(11);
  std::string bytes(1'000'000, ' ');
  for (char& c : bytes) c = static_cast<char>(random() & 0xff);
  CHECK(session(bytes).code <= 8);
  for (int i = 0; i < 30; ++i) {
    std::string piece = (i % 2 ? "." : "") + bytes.substr(static_cast<std::size_t>(i) * 3000, 3000);
    INFO(i);
    CHECK(session(piece).code <= 8);
  }
  // Without newlines, as a comment, as a text, as what goes on and on; and with all errors caught.
  std::string line = bytes;
  std::erase_if(line, [](char c) { return c == '\n' || c == '\r'; });
  CHECK(session(line).code <= 8);
  CHECK(session("--" + line + "\n1\n").out == "1\n");
  std::string letters = line;
  for (char& c : letters)
    if (c == '"' || c == '\\' || c == '\0') c = '\xff';
  CHECK(session("x = \"" + letters + "\"\n#x > 900000\n").out == "true\n");
  CHECK(session("\"\xff\xc3\xa9\xed\xa0\x80\"\n").out == "\"\\xff\xc3\xa9\\xed\\xa0\\x80\"\n");
  const Outcome utf8 = session(".\xff\xfe step\n.step \xff\n");
  CHECK(utf8.code >= 2);
  std::string words;
  for (int i = 0; i < 200; ++i)
    words += "pcall(help, \"" + letters.substr(static_cast<std::size_t>(i) * 40, 40) + "\")\n";
  CHECK(session(words).code == 0);
}
