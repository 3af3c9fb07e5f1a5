// The main function of the test program; compiled once, for it is slow to compile.
#define CATCH_CONFIG_MAIN
#include <catch2/catch.hpp>
#include <iostream>

namespace {

// Counts test cases, also those that were skipped (tests/support/skip.h), and prints lines that
// ctest and `./dev test` read.
class CaseCounter final : public Catch::TestEventListenerBase {
 public:
  using TestEventListenerBase::TestEventListenerBase;

  void testCaseStarting(const Catch::TestCaseInfo& info) override {
    TestEventListenerBase::testCaseStarting(info);
    name_ = info.name;
    needs_.clear();
  }

  bool assertionEnded(const Catch::AssertionStats& stats) override {
    constexpr const char* kSkipped = "skipped: ";
    if (stats.assertionResult.getResultType() != Catch::ResultWas::Warning) return false;
    for (const Catch::MessageInfo& message : stats.infoMessages)
      if (message.message.rfind(kSkipped, 0) == 0)
        needs_ = message.message.substr(std::string(kSkipped).size());
    return false;
  }

  void testCaseEnded(const Catch::TestCaseStats& stats) override {
    if (stats.totals.assertions.failed > 0) {
      ++failed_;
    } else if (needs_.empty()) {
      ++passed_;
    } else {
      ++skipped_;
      std::cout << "skipped: " << name_ << ": " << needs_ << std::endl;
    }
    TestEventListenerBase::testCaseEnded(stats);
  }

  void testRunEnded(const Catch::TestRunStats& stats) override {
    std::cout << "cases: " << passed_ << " passed, " << failed_ << " failed, " << skipped_
              << " skipped" << std::endl;
    TestEventListenerBase::testRunEnded(stats);
  }

 private:
  std::string name_, needs_;
  int passed_ = 0, failed_ = 0, skipped_ = 0;
};

}  // namespace

CATCH_REGISTER_LISTENER(CaseCounter)
