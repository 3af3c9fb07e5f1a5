// Studies that plugins bring: `sim NAME SCENE`, from a library that is built outside the tree.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>

#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

using Catch::Matchers::Contains;

std::string fixture(const std::string& name) {
  return std::string(SIM_FIXTURE_DIR) + "/" + name + "/" + name + ".so";
}

// The study that `sim plugin new study` begins with, in a folder of its own.
class NewStudy {
 public:
  NewStudy() {
    const Outcome made = run_sim({"plugin", "new", "study", "halved"}, {.folder = folder_.path()});
    INFO(made.err);
    REQUIRE(made.code == 0);
    CHECK_FALSE(std::filesystem::exists(place() / "halved.lua"));
    const auto begin = made.out.find("  g++ ");
    REQUIRE(begin != std::string::npos);
    const std::string line = made.out.substr(begin, made.out.find('\n', begin) - begin);
    const std::string bin = std::filesystem::path(SIM_BINARY).parent_path().string();
    REQUIRE(std::system(
                ("cd '" + place().string() + "' && PATH='" + bin + "':$PATH && " + line).c_str()) ==
            0);
  }

  std::filesystem::path place() const { return folder_.path() / "halved"; }
  Outcome sim(std::vector<std::string> words) const {
    words.insert(words.end(), {"--plugin-path", "."});
    return run_sim(words, {.folder = place()});
  }

 private:
  TemporaryFolder folder_;
};

TEST_CASE("a study of somebody else is a verb: run, help, list, describe, test, did you mean") {
  const NewStudy study;
  const Outcome test = run_sim({"test", "halved.so"}, {.folder = study.place()});
  INFO(test.out << test.err);
  CHECK(test.code == 0);
  CHECK_THAT(test.out, Contains("ends when it is told to"));

  // RK4: its change falls by 2^4 with each half of the step.
  const Outcome run =
      study.sim({"halved", "scenes/circle.lua", "-i", "rk4", "-d", "0.2", "-T", "2", "--json"});
  INFO(run.err);
  REQUIRE(run.code == 0);
  const Json found = read_json(run.out);
  const auto& points = found.at("points").list;
  REQUIRE(points.size() == 4);
  CHECK(points[0].at("dt").number == 0.2);
  CHECK(points[0].at("moved").kind == Json::Kind::kNull);
  CHECK(points[3].at("dt").number == 0.025);
  CHECK(points[2].at("moved").number / points[3].at("moved").number == Approx(16).epsilon(0.05));
  const Outcome words = study.sim({"--halvings", "1", "halved", "scenes/circle.lua"});
  CHECK(words.code == 2);  // its options stand behind it
  CHECK(lines_of(study.sim({"halved", "scenes/circle.lua", "--halvings", "1"}).out).size() == 3);

  const Outcome help = study.sim({"halved", "--help"});
  CHECK(help.code == 0);
  for (const char* part : {"--halvings N", "of the step; 3 if not given", "SCENE",
                           "It takes --integrator, --dt, --time,", "Keys of --json"})
    CHECK_THAT(help.out, Contains(part));
  CHECK(study.sim({"help", "halved"}).out == help.out);
  const std::string all = study.sim({"--help"}).out;
  CHECK_THAT(all, Contains("  halved                  SCENE: how far does a smaller step"));
  CHECK_THAT(all, Contains("  minimal                 SCENE: which of its parts"));
  CHECK_THAT(study.sim({"--man"}).out, Contains("sim halved"));
  CHECK_THAT(study.sim({"list", "studies"}).out, Contains("\n  halved"));
  CHECK_THAT(study.sim({"describe", "halved"}).out,
             Contains("study halved\n") && Contains("halvings"));
  CHECK_THAT(study.sim({"halfed", "scenes/circle.lua"}).err,
             Contains("unknown verb 'halfed'") || Contains("did you mean 'sim halved'?"));
  // By a library alone, too.
  CHECK(run_sim({"halved", "scenes/circle.lua", "-T", "0.1", "--load", "./halved.so"},
                {.folder = study.place()})
            .code == 0);
}

TEST_CASE("the options of a study are held to what its plugin declares") {
  const NewStudy study;
  const auto refused = [&](std::vector<std::string> words, const std::string& why) {
    words.insert(words.begin(), {"halved", "scenes/circle.lua"});
    const Outcome outcome = study.sim(words);
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.out.empty());
    CHECK_THAT(outcome.err, Contains(why));
  };
  refused({"--halvings", "0"}, "at least 1");
  refused({"--halvings", "21"}, "at most 20");
  refused({"--halvings", "some"}, "halvings");
  refused({"--halvins", "2"}, "did you mean '--halvings'?");
  refused({"--of", "sag"}, "sim halved does not take it");
  refused({"--steps", "3"}, "sim halved does not take it");
  refused({"scenes/cloth.lua"}, "scenes/cloth.lua");
  refused({"-T", "0"}, "--time '0'");
  refused({"-i", "rk5"}, "rk5");
  CHECK(study.sim({"halved", "scenes/nothing.lua"}).code == 5);
}

TEST_CASE("a study cannot take the name of a verb, and what is broken is told when it is named") {
  const Outcome taken = run_sim({"sweep", "scenes/circle.lua", "--load", fixture("named_as_verb")});
  CHECK(taken.code == 7);
  CHECK_THAT(taken.err, Contains("its study 'sweep' has the name of a verb of sim"));
  // Nobody asks for it here.
  CHECK(run_sim({"scenes/circle.lua", "-q", "--load", fixture("named_as_verb")}).code == 0);
  const TemporaryFolder folder;
  write_text(folder.path() / "halved.so", "no library");
  const Outcome help = run_sim({"--help", "--plugin-path", folder.path().string()});
  CHECK(help.code == 0);
  CHECK(run_sim({"minimal", "scenes/circle.lua", "--plugin-path", "/nonexistent"}).code == 5);
}

TEST_CASE("the extremes are a study, and sim stability --extremes still asks for it") {
  const std::vector<std::string> more{"--integrators", "rk4", "--json"};
  std::vector<std::string> one{"extremes"}, other{"stability", "--extremes"};
  for (auto* words : {&one, &other}) words->insert(words->end(), more.begin(), more.end());
  const Outcome study = run_sim(one);
  REQUIRE(study.code == 0);
  CHECK(study.out == run_sim(other).out);
  CHECK(read_json(study.out).at("integrators").list.size() == 1);
  CHECK(run_sim({"extremes", "scenes/cloth.lua"}).code == 2);
}

}  // namespace
}  // namespace sim_test
