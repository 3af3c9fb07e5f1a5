// Sessions through a pipe: every command with what it prints.
#include <catch2/catch.hpp>
#include <regex>
#include <set>

#include "tests/cli/program.h"
#include "tests/lua/scene_text.h"
#include "tests/support/temporary.h"

using namespace sim_test;

namespace {

Outcome session(const std::string& input, std::vector<std::string> arguments = {}) {
  return run_sim(arguments, {.program = SIM_REPL_BINARY, .input = input});
}

// The output of a session without errors.
std::string output(const std::string& input, std::vector<std::string> arguments = {}) {
  const Outcome outcome = session(input, std::move(arguments));
  INFO(input);
  CHECK(outcome.code == 0);
  // A step beyond the limit is warned of.
  CHECK((outcome.err.empty() || outcome.err.starts_with("sim: warning: ")));
  return outcome.out;
}

std::string hash_of_run(std::vector<std::string> arguments) {
  const std::string out = run_sim(arguments).out;
  std::smatch match;
  REQUIRE(std::regex_search(out, match, std::regex("hash +([0-9a-f]{16})")));
  return match[1].str() + "\n";
}

}  // namespace

TEST_CASE("repl: values of Lua are printed") {
  CHECK(output("1 + 1\n_ * 10\n\"a\\n\\0\"\nnil\ntrue\n1/0\n0.1 + 0.2\n2^53\n") ==
        "2\n20\n\"a\\n\\x00\"\nnil\ntrue\ninf\n0.30000000000000004\n9007199254740992.0\n");
  CHECK(output("1, \"b\", {}\n") == "1\n\"b\"\n{}\n");
  CHECK(output("t = {3, 2, b = 1, a = {x = {}}, [2.5] = 0, [\"not a name\"] = 1}\nt\n") ==
        "{3, 2, [2.5] = 0, a = {x = {}}, b = 1, [\"not a name\"] = 1}\n");
  CHECK(output("t = {} t.me = t; return t\n") == "{me = <cycle>}\n");
  CHECK(output("l = {} for i = 1, 100 do l[i] = 0 end return l\n").find("... 60 more\n}\n") !=
        std::string::npos);
  CHECK(output("x = {\n  1,\n  2\n}\nx\nfor i = 1, 2 do\n  print(i, \"x\")\nend\n") ==
        "{1, 2}\n1\tx\n2\tx\n");
  CHECK(output("function f(a)\n  return a\nend\nf\nf(3)\nsim.step\n") ==
        "<function at stdin:1>\n3\n<function>\n");
  CHECK(output("sim.particles{}\nrequire(\"sim\") == sim\n") == "<sim.particles>\ntrue\n");
  CHECK(output("d = {} for i = 1, 100 do d = {d, d} end return #d\n") == "2\n");
}

TEST_CASE("repl: a run ends at the time asked for, with a shorter last step") {
  const std::string hash = hash_of_run({"-T", "0.333"});
  const Outcome run = session(".run 0.333\n.t\n.hash\n");
  CHECK(run.out == "0.333\n" + hash);
  CHECK(run.err.starts_with("sim: note: the last step took 0.003 s\n"));
  CHECK(session(".integrator bdf2\n.run 0.333\n")
            .err.find("took 0.003 s; bdf2 keeps earlier steps, and begins anew there\n") !=
        std::string::npos);
  // The steps before it are what they were, and all come back bit for bit.
  const Outcome back = session(
      ".run 0.333\n.step 30\nh = hash()\n.back 40\n.t\n.step 40\nhash() == h\n.t\n"
      ".back 31\n.t\n.goto 0.333\n.t\n.hash\n");
  CHECK(back.out == "0.28500000000000003\ntrue\n0.483\n0.33\n0.333\n" + hash);
  // Beyond what is known only: a run in the past is what it was.
  CHECK(session(".run 0.5\n.back 50\n.run 0.123\n.t\n").out == "0.375\n");
}

// Without drag nothing has to be looked at after each step, and verlet takes several at once.
TEST_CASE("repl: steps that are taken together end before the shorter one") {
  const TemporaryFolder folder;
  const std::string scene = (folder.path() / "net.lua").string();
  write_text(
      scene,
      "local sim = require 'sim'\n"
      "local c = sim.grid { 8, 8, origin = {0, 0, 0}, du = {0, 0, 0.05}, dv = {0.05, 0, 0},\n"
      "  mass = 0.01 }\nc:pin(0)\n"
      "return sim.scene { particles = c, forces = { sim.force.gravity {},\n"
      "  sim.force.spring { stiffness = 50, grid = c, offsets = { {0, 1}, {1, 0} } } },\n"
      "  integrator = 'verlet', dt = 0.002, duration = 1 }\n");
  for (const std::string end : {"0.3331", "0.5555", "1.2345", "1.9991"}) {
    INFO(end);
    CHECK(session(".run " + end + "\n.t\n.hash\n", {scene}).out ==
          end + "\n" + hash_of_run({scene, "-T", end}));
  }
}

TEST_CASE("repl: steps, runs and times, as sim takes them") {
  const std::string hash = hash_of_run({});
  CHECK(output(".step 400\n.hash\n") == hash);
  CHECK(output("sim.step(399)\nstep()\n.hash\n.t\n.taken\n") == hash + "2.0\n400\n");
  const Outcome run = session(".run\n.hash\n");
  CHECK(run.out == hash);
  CHECK(run.err.rfind("trusted: positions to 1e-05 m (verified), energy to 0.0002 %", 0) == 0);
  CHECK(run.err == run_sim({"scenes/cloth.lua"}).err);
  CHECK(session("sim.run(0.5)\n.run 1.5\n.hash\n").out == hash);
  CHECK(output("run(2)\nhash()\n") == "\"" + hash.substr(0, 16) + "\"\n");
  CHECK(output(".goto 3\n.back 200\n.hash\n.goto 1\n.goto 2\n.hash\n") == hash + hash);
  CHECK(output("sim.goto_time(2.001)\nback(0)\n.hash\n") == hash);
  CHECK(output(".step 500\n.reset\n.t\n.step 400\n.hash\n") == "0.0\n" + hash);
  CHECK(output(".step 7\n.step 0\n.taken\n") == "7\n");

  const Outcome until = session(".until t() >= 0.0999\n.taken\n.until false or t() > 0.12\n.t\n");
  CHECK(until.out == "20\n0.125\n");
  CHECK(output("run_until(function() return taken() >= 30 end)\ntaken()\n") == "30\n");
  CHECK(output(".sw\n", {"-e", "t()"}) == "0.0\n");
}

// A force that jumps at 1 s: its work is known in steps that are looked at one by one.
TEST_CASE("repl: the work of forces is the same in a run and until something happens") {
  const sim::test::SceneFolder folder;
  const std::string kick = folder.write(
      "kick.lua",
      "local sim = require 'sim'\nlocal p = sim.particles { mass = 1 }\np:pin(p:add {0, 0, 0})\n"
      "p:add {1, 0, 0}\nreturn sim.scene { particles = p, forces = {\n"
      "sim.force.spring { stiffness = 100, ties = { {0, 1} } },\n"
      "sim.force.expression { fx = 'if(t>1, 20, 0)' }, sim.force.drag { k = 2 } },\n"
      "integrator = 'rk4', dt = 0.01, duration = 6 }\n");
  const std::string told = "print(energy().work, energy().drift)\n";
  const Outcome until = session(".until t() >= 1.075\n" + told, {kick});
  const Outcome run = session(".run 1.08\n" + told, {kick});
  CHECK(until.out == run.out);
  CHECK(until.out.starts_with("-1.00"));
  CHECK(until.err.find("energy fell") == std::string::npos);
}

TEST_CASE("repl: what one verb prints in sim the same prints here") {
  CHECK(output(".springs 12\n")
            .starts_with(run_sim({"adjacency", "scenes/cloth.lua", "12"}).out + "particle 12 at "));
  CHECK(output(".mode json\n.springs 12\n") ==
        run_sim({"adjacency", "scenes/cloth.lua", "12", "--json"}).out);
  CHECK(output(".plugins\n") == run_sim({"list"}).out);
  CHECK(output(".plugins forces\n") == run_sim({"list", "forces"}).out);
  CHECK(output(".mode json\n.plugins forces\n") == run_sim({"list", "forces", "--json"}).out);
  CHECK(output("spring?\n") == run_sim({"describe", "spring"}).out);
  CHECK(output(".help rk4\n") == run_sim({"describe", "rk4"}).out);
  CHECK(output("scenes/circle.lua?\n") == run_sim({"describe", "scenes/circle.lua"}).out);

  const std::vector<std::string> five{"scenes/pendulum.lua", "--steps", "5", "--every", "5", "-q"};
  auto dump = five, energy = five;
  dump.push_back("--dump");
  energy.push_back("--energy");
  CHECK(output(".dump\n.step 5\n.mode csv\n.dump\n", {"scenes/pendulum.lua"}) == run_sim(dump).out);
  CHECK(output(".mode csv\n.energy\n.step 5\n.energy\n", {"scenes/pendulum.lua"}) ==
        run_sim(energy).out);
  CHECK(output(".energy\n").substr(0, 80) ==
        "     step     t [s]     kinetic   potential       total        work   drift [J]\n");
  // Nobody knows what drag took on the way to a state that was set by hand.
  CHECK(output(".step 5\n.set_velocity 12 1 0 0\ne = energy()\ne.work, e.drift\n") == "nil\nnil\n");
}

TEST_CASE("repl: the state is shown and changed") {
  CHECK(output(".position 12\nposition(12)\n.velocity 12\n") ==
        "{0.5, 0.0, 0.125}\n{0.5, 0.0, 0.125}\n{0.0, 0.0, 0.0}\n");
  CHECK(
      output(".set_velocity 12 1 -2 0.5\n.velocity 12\nset_velocity(12, {0, 1, 0})\nvelocity(12)\n"
             "set_position(12, 1, 2, 3)\n.position 12\n") ==
      "{1.0, -2.0, 0.5}\n{0.0, 1.0, 0.0}\n{1.0, 2.0, 3.0}\n");
  CHECK(output(".unpin 0 7\n.step 10\nposition(0)[2] < 0\n.pin 0 7\nx = position(0)\n.step\n"
               "position(0)[2] == x[2]\nvelocity(0)\n") == "true\ntrue\n{0.0, 0.0, 0.0}\n");
  CHECK(output(".step 10\n.set_velocity 9 5 0 0\n.step 10\n.undo\n.hash\n") ==
        output(".step 20\n.hash\n"));
  CHECK(output(".forces 12\n") ==
        "force              x [N]         y [N]         z [N]      size [N]\n"
        "gravity                0     -0.153281             0      0.153281\n"
        "drag                   0             0             0             0\n"
        "structural             0             0             0             0\n"
        "shear                  0             0             0             0\n"
        "flex                   0             0             0             0\n"
        "sum                    0     -0.153281             0      0.153281\n");
  CHECK(output("forces(12)[1]\n") ==
        "{force = \"gravity\", size = 0.15328125, x = 0.0, y = -0.15328125, z = 0.0}\n");
  CHECK(output("e = energy()\ne.total, e.drift, e.step, e.t\n") == "0.0\n0.0\n0\n0.0\n");
  CHECK(output("#springs(12), springs(12)[1].to\n") == "11\n4\n");
}

TEST_CASE("repl: flat states and points") {
  TemporaryFolder folder;
  const auto file = folder.path() / "decay.lua";
  write_text(file,
             "local sim = require \"sim\"\n"
             "return sim.scene { name = \"decay\", state = { 4, 2 }, integrator = \"euler\",\n"
             "  dt = 0.5, duration = 1, field = sim.field.lua { function(t, x)\n"
             "    return { -x[1], -x[2] } end } }\n");
  CHECK(output(".component 1\n.set_component 1 8\n.step\ncomponent(0), component(1)\n.dump\n",
               {file.string()}) == "2.0\n2.0\n4.0\nstep,t,component,value\n1,0.5,0,2\n1,0.5,1,4\n");
  CHECK(session(".energy\n", {file.string()}).code == 2);
  CHECK(session(".position 0\n", {file.string()}).code == 2);
  CHECK(session(".set_velocity 0 1 1 1\n", {"scenes/circle.lua"}).code == 2);
  CHECK(output(".position 0\n", {"scenes/circle.lua"}) == "{1.0, 0.0, 0.0}\n");
}

TEST_CASE("repl: settings of the scene") {
  CHECK(
      output(".dt\n.dt 0.004\n.dt\n.step\n.t\n.integrator\n.integrator r\n.integrator\n"
             ".integrator dopri5:tol=1e-8\n.integrator\nsim.integrator(\"dopri5\", {tol = 1e-7})\n"
             "sim.integrator().tol\n.dt 0.001\n.step\n.t\n") ==
      "0.005\n0.004\n0.004\nrk4\nrk4\ndopri5 tol=1e-08\n1e-07\n0.005\n");
  // The scene language has sim.integrator too.
  CHECK(output("sim.integrator.dopri5 { tol = 1e-8 }\nsim.integrator(\"verlet\")\n"
               "sim.integrator().name\n") == "<sim.integrator>\n\"verlet\"\n");
  // t does not accumulate: t0 + (n - n0) h.
  CHECK(output(".step 3\n.dt 0.01\n.step 3\n.t\n") == "0.045\n");
  CHECK(output(".set\n") ==
        "name        value  default  meaning\nn           8      8        particles a side\n"
        "structural  100    100      N/m\nshear       50     50       N/m\n"
        "flex        25     25       N/m\n");
  CHECK(output(".step 10\n.set n 4\n.set n 4\n.hash\n") ==
        "n          8 -> 4\nparticles  64 -> 16\nsprings    306 -> 58\n"
        "energy     -0.0072113 J -> -0.00651421 J\n"
        "nothing changed: the same bits at t = 0.05 s\n" +
            hash_of_run({"-n", "10", "-s", "n=4"}));
  CHECK(output(".integrator\n.dt\nset()[1].value\n",
               {"scenes/cloth.lua", "verlet", "0.001", "--set", "n=5"}) == "verlet\n0.001\n5.0\n");
  // Choices of integrator and dt outlast a reload.
  CHECK(output(".integrator verlet\n.dt 0.001\n.step 10\n.reload\n.hash\n") ==
        "changes by hand  2 -> only integrator and dt, from the start\n" +
            hash_of_run({"scenes/cloth.lua", "verlet", "0.001", "-n", "10"}));
}

TEST_CASE("repl: reload says what an edit of the file changed") {
  TemporaryFolder folder;
  const auto file = folder.path() / "cloth.lua";
  std::string text = read_text(std::string(SIM_SOURCE_DIR) + "/scripts/scenes/cloth.lua");
  const auto edit = [&](const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    return text.substr(0, at) + to + text.substr(at + from.size());
  };
  write_text(file, text);
  write_text(folder.path() / "edited.lua", edit("\"structural\", 100", "\"structural\", 101"));
  write_text(folder.path() / "broken.lua", edit("return sim.scene", "return sim.scenes"));
  Outcome outcome = session(".step 20\n.reload\n", {file.string()});
  CHECK(outcome.out == "nothing changed: the same bits at t = 0.1 s\n");

  const auto replaced = [&](const std::string& with) {
    // The file changes between two commands: once a snapshot tells that the first ones ran.
    const std::string snapshot = (folder.path() / (with + ".snap")).string();
    const std::string commands =
        "{ echo '.step 20'; echo 'print(t())'; echo '.snap " + snapshot + "'; while [ ! -e " +
        snapshot + " ]; do sleep 0.01; done; cp " + (folder.path() / with).string() + " " +
        file.string() + "; echo .reload; echo .hash; } | " + SIM_REPL_BINARY + " " + file.string();
    return run_sim({"-c", commands}, {.program = "/bin/sh"});
  };
  outcome = replaced("edited.lua");
  CHECK(outcome.code == 0);
  CHECK(lines_of(outcome.out).at(1) == "structural                      100 -> 101");
  CHECK(lines_of(outcome.out).at(3).starts_with("most changed: "));
  outcome = replaced("broken.lua");
  CHECK(outcome.code == 3);
  CHECK(outcome.err.find("broken") == std::string::npos);
  CHECK(outcome.err.find("did you mean 'scene'?") != std::string::npos);
}

TEST_CASE("repl: branches") {
  const std::string tree = ".step 100\n.branch euler\n.step 20\n.switch euler\n.integrator euler\n";
  CHECK(output(tree + ".step 10\n.branch\n") ==
        "* euler  step 110, t = 0.55 s\n  main   step 120, t = 0.6 s\n");
  const std::string diff = output(tree + ".step 10\n.diff euler main\n");
  CHECK(diff.starts_with("first difference at step 101, t = 0.505 s, particle 1, x\n  euler  0."));
  CHECK(diff.find(" ulp, ") != std::string::npos);
  CHECK(output(tree + ".step 10\nd = diff(\"main\")\nd.step, d.particle, d.quantity\n") ==
        "101\n1\n\"x\"\n");
  CHECK(output(".branch a\n.step 10\n.diff a\n") == "no difference between a and main\n");
  CHECK(output(tree + ".step 10\n.switch main\n.hash\n.integrator\n.switch euler\n.integrator\n"
                      ".taken\n") == hash_of_run({"-n", "120"}) + "rk4\neuler\n110\n");
  CHECK(session(".branch main\n").code == 2);
  CHECK(session(".switch eule\n").code == 2);
}

TEST_CASE("repl: worlds") {
  const std::vector<std::string> sample{"scenes/sample.lua"};
  // Here the systems come in order, there as they arrive.
  const Outcome run = run_sim({"scenes/sample.lua", "-n", "10", "--dump", "--every", "10", "-q"});
  std::multiset<std::string> rows, last_rows;
  for (const std::string& line : lines_of(output(".step 10\n.dump\n", sample))) rows.insert(line);
  for (const std::string& line : lines_of(run.out))
    if (std::regex_search(line, std::regex("^(system|[a-z]+,10),"))) last_rows.insert(line);
  CHECK(rows.size() == 70);
  CHECK((rows == last_rows));
  CHECK(output(".system\n.system pendulum\n.position 1\n.system circle\n.position 0\n", sample) ==
        "  circle\n* cloth\n  pendulum\n{0.5, 0.0, 0.0}\n{1.0, 0.0, 0.0}\n");
  CHECK(lines_of(output(".hash\n", sample)).size() == 3);
  CHECK(output(".system\n", sample) == "  circle\n* cloth\n  pendulum\n");
  CHECK(output(".step 20\n.back 7\n.step 7\n.hash\n", sample) ==
        output(".step 20\n.hash\n", sample));
}

TEST_CASE("repl: checkpoints, and the same of sim") {
  TemporaryFolder folder;
  const std::string file = (folder.path() / "a.snap").string();
  const std::string table = (folder.path() / "a.csv").string();
  CHECK(output(".integrator verlet\n.dt 0.002\n.set n 5\n.unpin 0\n.step 100\n.snap " + file +
               "\n.dump " + table + "\n")
            .starts_with("n "));
  CHECK(lines_of(read_text(table)).size() == 26);
  const std::string hash = output(".resume " + file + "\n.pin 3\n.undo\n.step 50\n.hash\n");
  CHECK(hash == output(".step 50\n.hash\n", {"--resume", file}));
  CHECK(hash == hash_of_run({"--resume", file, "-n", "150"}));
  const Outcome energy =
      run_sim({"--resume", file, "-n", "150", "--energy", "--every", "50", "-q"});
  CHECK(output(".mode csv\n.energy\n.step 50\n.energy\n", {"--resume", file}) == energy.out);
  CHECK(session(".resume " + table + "\n").code == 6);
  CHECK(session("", {"scenes/pendulum.lua", "--resume", file}).code == 6);
  CHECK(session("", {"--resume", file, "-d", "0.1"}).code == 6);
  CHECK(session("", {"--resume", file, "-i", "rk4"}).code == 6);
  CHECK(session(".snap -\n").code == 2);
  CHECK(session(".snap /nowhere/a\n").code == 5);
  CHECK(session(".resume /nowhere/a\n").code == 5);
}

TEST_CASE("repl: modes") {
  CHECK(output(".mode\n.mode json\n.mode\n{1, 2}\n{a = 1, b = "
               "{true}}\n\"x\\xff\"\n0/0\nposition(0)\n") ==
        "text\n\"json\"\n[1,2]\n{\"a\":1,\"b\":[true]}\n\"x\xEF\xBF\xBD\"\nnull\n[0,0,0]\n");
  CHECK(
      output(".mode csv\n{1, 2}\n{a = 1, b = \"x,y\"}\n{a = 2, b = 0}\n{{c = 1}, {c = 2}}\n4\n") ==
      "1,2\na,b\n1,\"x,y\"\n2,0\nc\n1\n2\n4\n");
  CHECK(output("t()\n", {"--mode", "json"}) == "0\n");
  TemporaryFolder folder;
  const std::string file = (folder.path() / "energy.jsonl").string();
  run_sim({"-n", "1", "-q", "--energy=" + file});
  CHECK(output(".energy\n.step\n.energy\n", {"--mode", "json"}) == read_text(file));
}

// .help lists each command as `NAME? ` tells of it: its use, what it does, its name in Lua.
TEST_CASE("repl: help on each command, and on plugins as sim describes them") {
  struct Listed {
    std::string use, help;
  };
  std::vector<Listed> listed;
  std::vector<std::string> sections;
  const std::vector<std::string> lines = lines_of(output(".help\n"));
  for (std::size_t i = 1; i < lines.size(); ++i) {
    if (lines[i].starts_with("A command may be shortened")) break;
    if (lines[i].empty()) continue;
    if (lines[i][0] != ' ') {
      sections.push_back(lines[i]);
      CHECK(lines[i - 1].empty());
    } else if (lines[i].starts_with("  .")) {
      const std::size_t gap = lines[i].find(' ', 24);
      // The help begins in column 26, or one behind a use that is longer.
      const std::size_t wide = lines[i].size() > 25 && lines[i][25] == ' ' ? 26 : gap + 1;
      std::string use = lines[i].substr(2, wide - 3);
      use.erase(use.find_last_not_of(' ') + 1);
      listed.push_back({use, lines[i].substr(wide)});
    } else {
      CHECK(lines[i].starts_with(std::string(26, ' ')));
      listed.back().help += " " + lines[i].substr(26);
    }
  }
  CHECK(listed.size() > 40);
  CHECK(std::set<std::string>(sections.begin(), sections.end()).size() == sections.size());
  CHECK(sections.front() == "time");
  std::string asked, expected;
  std::set<std::string> names;
  for (const Listed& each : listed) {
    const std::string name = each.use.substr(1, each.use.find(' ') - 1);
    CHECK(names.insert(name).second);
    asked += "." + name + "?\n";
    expected += each.use + "\n  " + each.help + "\n  in Lua: sim.";
  }
  // The names in Lua aside.
  const std::string said =
      std::regex_replace(output(asked), std::regex("sim\\.[a-z_]+\\(\\.\\.\\.\\)\n"), "sim.");
  CHECK(said == expected);

  for (const char* name : {"spring", "rk4", "scenes/circle.lua"}) {
    INFO(name);
    const std::string described = run_sim({"describe", name}).out;
    CHECK(described.size() > 100);
    CHECK(output(std::string(name) + "?\n").ends_with(described));
  }
  const auto refused = [](const std::string& line) {
    const Outcome outcome = session(line + "\n");
    CHECK(outcome.code == 2);
    return outcome.err;
  };
  CHECK(refused("sprnig?").find("did you mean 'spring'?") != std::string::npos);
  CHECK(refused("steep?").find("did you mean 'step'?") != std::string::npos);
  CHECK(refused("gridd?").find("did you mean 'grid'?") != std::string::npos);
  CHECK(refused("qqqqqqqqqqq?").find(".help lists the commands") != std::string::npos);
  CHECK(refused(".sprnig?").find("did you mean '.springs'?") != std::string::npos);  // no command
}

TEST_CASE("repl: help, time, read and the end") {
  CHECK(output("?\n") == output(".help\n"));
  CHECK(output(".help\n").find("\ntime\n  .step [N] ") != std::string::npos);
  CHECK(output("step?\n") == ".step [N]\n  N steps, or one\n  in Lua: sim.step(...)\n");
  CHECK(output(".goto?\n") == output("goto_time?\n"));
  CHECK(output("sim.grid?\n").starts_with("grid = sim.grid { rows, cols, origin =, du =, dv ="));
  CHECK(output("particles:add?\n").starts_with("id = particles:add({x, y, z}, { mass =, "));
  CHECK(output("sim.force.spring?\n").starts_with("force spring\n"));
  CHECK(output(".ener\n") == output(".energy\n"));

  const Outcome timed = session(".time x = 1\n.time .step 100\n.taken\n");
  CHECK(timed.out == "100\n");
  CHECK(std::regex_match(timed.err, std::regex("[0-9.e-]+ s\n[0-9.e-]+ s: 100 steps, [0-9.e-]+ us "
                                               "a step, [0-9.e+]+ x real time\n")));
  // Three digits each.
  const std::regex number("[0-9.]+(?=[e ])");
  for (std::sregex_iterator at(timed.err.begin(), timed.err.end(), number), last; at != last;
       ++at) {
    std::string digits = at->str();
    std::erase(digits, '.');
    digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size()));
    CHECK(digits.size() <= 3);
  }
  CHECK(output("time(function() step(3) end) < 10, taken()\n") == "true\n3\n");

  TemporaryFolder folder;
  const std::string file = (folder.path() / "a.lua").string();
  write_text(file, "#!/usr/bin/simrepl\n-- a comment\n.step 3\nx = {\n  1 }\nx, taken()\n");
  CHECK(output(".read " + file + "\n") == "{1}\n3\n");
  CHECK(output("", {"-f", file, "-e", "2"}) == "{1}\n3\n2\n");
  CHECK(output("", {"-e", "2", "-f", file}) == "2\n{1}\n3\n");
  CHECK(output("1\n.quit\n2\n") == "1\n");
  CHECK(output("1\nquit\n2\n") == "1\n");
  CHECK(output("") == "");
  CHECK(output("1\r\n.t\r\n") == "1\n0.0\n");
}
