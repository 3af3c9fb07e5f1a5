// The words of `sim tradeoff` on a study that was cut short.
#include <catch2/catch.hpp>

#include "core/report/tradeoff_report.h"

using namespace sim;

TEST_CASE("a trade-off that is cut short says nothing of the fastest mode") {
  study::WorkPrecision cut;  // as it is before its reference and the modes are known
  cut.system = "pendulum";
  cut.time = 10;
  cut.size = 2;
  cut.unit = "m";
  cut.complete = false;
  const std::string text = report::tradeoff_text(cut, {}, {});
  INFO(text);
  CHECK(text.find("pendulum to t = 10 s, size 2 m") != std::string::npos);
  CHECK(text.find("fastest") == std::string::npos);
  const std::string json = report::tradeoff_json(cut, {}, {});
  INFO(json);
  CHECK(json.find("\"omega_max\":null") != std::string::npos);
}
