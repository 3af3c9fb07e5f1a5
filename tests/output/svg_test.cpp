// Charts as SVG: where marks stand, and that no word crosses another.
#include "core/output/svg.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <regex>
#include <sstream>

namespace {

// The room of words at 13 px, by the measure that charts are laid out with: 7.9 px a letter.
struct Words {
  std::string text;
  double x, y, half_width;  // px, their midst
};

std::vector<std::vector<double>> numbers_of(const std::string& svg, const std::string& pattern) {
  std::vector<std::vector<double>> found;
  const std::regex regex(pattern);
  for (std::sregex_iterator it(svg.begin(), svg.end(), regex), end; it != end; ++it) {
    std::vector<double>& row = found.emplace_back();
    for (std::size_t k = 1; k < it->size(); ++k) row.push_back(std::stod((*it)[k].str()));
  }
  return found;
}

// Names of curves begin where they stand; the name of a ring has its midst there.
std::vector<Words> words_of(const std::string& svg) {
  std::vector<Words> found;
  const std::regex regex("<text x=\"([^\"]*)\" y=\"([^\"]*)\"([^>]*)>([^<]*)</text>");
  for (std::sregex_iterator it(svg.begin(), svg.end(), regex), end; it != end; ++it) {
    const std::string style = (*it)[3];
    if (style.find("paint-order") == std::string::npos) continue;
    const double half = 0.5 * 7.9 * static_cast<double>((*it)[4].length());
    const bool middle = style.find("middle") != std::string::npos;
    found.push_back(
        {(*it)[4], std::stod((*it)[1]) + (middle ? 0 : half), std::stod((*it)[2]) - 4.5, half});
  }
  return found;
}

// px^2
double overlap(const Words& a, const Words& b) {
  const double w = a.half_width + b.half_width - std::fabs(a.x - b.x);
  const double h = 13 - std::fabs(a.y - b.y);
  return w > 0 && h > 0 ? w * h : 0;
}

sim::Chart chart_of(int curves) {
  sim::Chart chart;
  for (int c = 0; c < curves; ++c) {
    sim::ChartCurve& curve = chart.curves.emplace_back();
    curve.name = "method " + std::to_string(c) + (c % 2 ? " of order four" : "");
    curve.strong = c != 1;
    for (int k = 0; k < 6; ++k)
      curve.points.emplace_back(std::pow(10, 0.5 * k), std::pow(10, -0.3 * k * (1 + 0.1 * c)));
  }
  return chart;
}

}  // namespace

TEST_CASE("a chart has its points where their logarithms stand between its decades", "[output]") {
  const std::string svg = sim::svg(chart_of(1));
  // The first and the last point span 2.5 decades across and 1.5 down.
  const auto discs = numbers_of(svg, "<circle cx=\"([^\"]*)\" cy=\"([^\"]*)\"");
  REQUIRE(discs.size() == 6);
  const double wide = discs[5][0] - discs[0][0], high = discs[5][1] - discs[0][1];
  CHECK((wide > 400 && high > 300));
  for (std::size_t k = 0; k < 6; ++k) {
    const double share = static_cast<double>(k) / 5;
    CHECK(discs[k][0] == Approx(discs[0][0] + share * wide).margin(0.011));
    CHECK(discs[k][1] == Approx(discs[0][1] + share * high).margin(0.011));
  }
  // Lines of decades: 1, 10, 100 across; 1, 0.1 up.
  const auto lines = numbers_of(svg,
                                "<line x1=\"([^\"]*)\" y1=\"([^\"]*)\" x2=\"([^\"]*)\" "
                                "y2=\"([^\"]*)\" stroke=\"#e5e7eb\"/>");
  REQUIRE(lines.size() == 5);
  for (std::size_t k = 0; k < 3; ++k)
    CHECK(lines[k][0] == Approx(discs[0][0] + static_cast<double>(k) / 2.5 * wide).margin(0.011));
  for (std::size_t k = 3; k < 5; ++k)
    CHECK(lines[k][1] ==
          Approx(discs[0][1] + (4.0 - static_cast<double>(k)) / 1.5 * high).margin(0.011));
}

TEST_CASE("names on a chart cross no others, wherever the ring is", "[output]") {
  for (const int curves : {1, 4, 7}) {
    sim::Chart chart = chart_of(curves);
    for (int i = 0; i <= 12; ++i)
      for (int j = 0; j <= 12; ++j) {
        chart.ring =
            sim::ChartRing{std::pow(10, 2.5 * i / 12), std::pow(10, -2.4 * j / 12), "best"};
        const std::string svg = sim::svg(chart);
        const std::vector<Words> words = words_of(svg);
        REQUIRE(words.size() == static_cast<std::size_t>(curves) + 1);
        INFO(curves << " curves, ring " << i << " " << j);
        CHECK(words.back().text == "best");
        double most = 0;
        for (std::size_t a = 0; a < words.size(); ++a)
          for (std::size_t b = 0; b < a; ++b) most = std::max(most, overlap(words[a], words[b]));
        CHECK(most < 40);
        for (const Words& each : words)
          CHECK((each.x - each.half_width > 0 && each.x + each.half_width < 900));
      }
  }
}

namespace {

// The polylines of a chart, each as its corners.
std::vector<std::vector<std::array<double, 2>>> paths_of(const std::string& svg) {
  std::vector<std::vector<std::array<double, 2>>> paths;
  const std::regex path("<path d=\"M([^\"]*)\"");
  for (std::sregex_iterator it(svg.begin(), svg.end(), path), end; it != end; ++it) {
    std::string corners = (*it)[1];
    std::ranges::replace(corners, 'L', ' ');
    std::istringstream numbers(corners);
    paths.emplace_back();
    for (std::array<double, 2> p{}; numbers >> p[0] >> p[1];) paths.back().push_back(p);
  }
  return paths;
}

// How many of the points of all polylines, every half px, are under the words.
int covered(const std::vector<std::vector<std::array<double, 2>>>& paths, const Words& words) {
  int count = 0;
  for (const auto& path : paths)
    for (std::size_t i = 1; i < path.size(); ++i) {
      const double dx = path[i][0] - path[i - 1][0], dy = path[i][1] - path[i - 1][1];
      const double pieces = std::ceil(2 * std::hypot(dx, dy));
      for (double k = 0; k <= pieces; ++k)
        count += std::abs(path[i - 1][0] + dx * k / pieces - words.x) < words.half_width &&
                 std::abs(path[i - 1][1] + dy * k / pieces - words.y) < 5;
    }
  return count;
}

}  // namespace

TEST_CASE("words on a chart lie on no curve", "[output]") {
  for (const int curves : {1, 4, 7}) {
    sim::Chart chart = chart_of(curves);
    chart.ring = sim::ChartRing{10, std::pow(10, -0.6), "recommended: one of them"};
    chart.lines = {{0.05, "a budget", true}};
    chart.orders = {1, 2, 4};
    const std::string svg = sim::svg(chart);
    const auto paths = paths_of(svg);
    REQUIRE(paths.size() == static_cast<std::size_t>(curves));
    std::vector<Words> words = words_of(svg);
    // The name of the line is 12 px high; words of the slopes have 11.
    const std::regex small("<text x=\"([^\"]*)\" y=\"([^\"]*)\" font-size=\"1[12]\"[^>]*>([^<]+)<");
    for (std::sregex_iterator it(svg.begin(), svg.end(), small), end; it != end; ++it) {
      const double half = 0.42 * 7.9 * static_cast<double>((*it)[3].length());
      words.push_back({(*it)[3], std::stod((*it)[1]) + half, std::stod((*it)[2]) - 4, half});
    }
    REQUIRE(words.size() >= static_cast<std::size_t>(curves) + 2 + 4);
    for (const Words& each : words) {
      INFO(curves << " curves: " << each.text);
      CHECK(covered(paths, each) == 0);
    }
  }
}

// A curve that falls as 1 / x^p is parallel to the line of its order.
TEST_CASE("the slopes of orders are those of curves of these orders", "[output]") {
  sim::Chart chart;
  for (const int order : {1, 4}) {
    sim::ChartCurve& curve = chart.curves.emplace_back();
    curve.name = std::to_string(order);
    for (const double x : {1.0, 10.0, 100.0}) curve.points.emplace_back(x, std::pow(x, -order));
  }
  chart.orders = {1, 4};
  const std::string svg = sim::svg(chart);
  const auto lines = numbers_of(svg,
                                "<line x1=\"([^\"]*)\" y1=\"([^\"]*)\" x2=\"([^\"]*)\" "
                                "y2=\"([^\"]*)\" stroke=\"#9ca3af\"/>\n<text");
  const auto paths = paths_of(svg);
  REQUIRE((lines.size() == 2 && paths.size() == 2));
  for (std::size_t k = 0; k < 2; ++k) {
    const double own = (lines[k][3] - lines[k][1]) / (lines[k][2] - lines[k][0]);
    const double curve = (paths[k][2][1] - paths[k][0][1]) / (paths[k][2][0] - paths[k][0][0]);
    CHECK(own == Approx(curve).epsilon(1e-2));  // coordinates have two decimals
  }
}

TEST_CASE("sizes below a chart over time stand on decades", "[output]") {
  sim::TimeChart chart{.title = "x", .y_name = "m", .curves = {{"a", {{0, 0}, {3, 1}}}}};
  const std::string plain = sim::svg(chart);
  chart.sizes_name = "size of drift [J]";
  chart.sizes = {{"drift", {{0, 0}, {1, 1e-6}, {2, 1e-4}, {3, 1e-2}}}};
  const std::string svg = sim::svg(chart);
  CHECK(svg.find("size of drift [J]") != std::string::npos);
  const auto paths = paths_of(svg);
  REQUIRE(paths.size() == 2);
  REQUIRE(paths[1].size() == 4);
  const auto& drift = paths[1];
  CHECK(drift[1][1] - drift[2][1] == Approx(drift[2][1] - drift[3][1]).margin(0.02));
  CHECK(drift[0][1] > drift[1][1]);  // 0, on the floor
  CHECK(drift[2][0] - drift[1][0] == Approx(drift[1][0] - drift[0][0]).margin(0.02));
  CHECK(drift[3][1] > 380);  // below the chart, which stays as it was
  CHECK(paths[0] == paths_of(plain)[0]);
}

TEST_CASE("an axis of time has between three and seven spaces of round size", "[output]") {
  const auto ticks = [](double last) {
    sim::TimeChart chart;
    chart.title = "x";
    chart.y_name = "m";
    chart.curves = {{"a", {{0, 0}, {last, 1}}}};
    // The words of the axis of time have their midst below its marks.
    std::vector<double> found;
    const std::string svg = sim::svg(chart);
    for (const auto& row :
         numbers_of(svg, "<text x=\"[^\"]*\" y=\"350[.0]*\"[^>]*>([-+0-9.e]+)</text>"))
      found.push_back(row[0]);
    return found;
  };
  CHECK(ticks(7) == std::vector<double>{0, 1, 2, 3, 4, 5, 6, 7});
  CHECK(ticks(8) == std::vector<double>{0, 2, 4, 6, 8});
  CHECK(ticks(14) == std::vector<double>{0, 2, 4, 6, 8, 10, 12, 14});
  CHECK(ticks(20) == std::vector<double>{0, 5, 10, 15, 20});
  CHECK(ticks(39) == std::vector<double>{0, 10, 20, 30});
}

// The horizontal axis is of decades: a bar is longer than another by the same length for each
// factor of ten. Values that are not below the mark are green.
TEST_CASE("bars end where their values are") {
  sim::BarChart chart{.title = "steps", .x_name = "[s]", .mark = 0.01};
  for (const double value : {1e-4, 0.0099, 0.01, 1.0, 0.0, HUGE_VAL})
    chart.bars.push_back({"method", "words", value});
  const std::string svg = sim::svg(chart);
  const auto bars = numbers_of(svg,
                               "<rect x=\"([^\"]*)\" y=\"([^\"]*)\" width=\"([^\"]*)\" "
                               "height=\"([^\"]*)\" fill=\"#b91c1c\"");
  const auto good = numbers_of(svg,
                               "<rect x=\"([^\"]*)\" y=\"([^\"]*)\" width=\"([^\"]*)\" "
                               "height=\"([^\"]*)\" fill=\"#15803d\"");
  REQUIRE(bars.size() == 2);
  REQUIRE(good.size() == 3);  // 0 has none
  const double decade = (good[1][2] - bars[0][2]) / 4;
  CHECK(decade > 50);
  CHECK(good[0][2] - bars[0][2] == Approx(2 * decade).margin(0.02));
  CHECK(bars[1][2] - bars[0][2] == Approx(decade * (2 + std::log10(0.99))).margin(0.02));
  CHECK(good[2][2] > good[1][2]);  // infinity
  const auto marks = numbers_of(svg, "<line x1=\"([^\"]*)\"[^>]*stroke=\"#111827\"");
  REQUIRE(marks.size() == 1);
  CHECK(marks[0][0] == Approx(good[0][0] + good[0][2]).margin(0.02));
  for (std::size_t i = 1; i < 3; ++i) CHECK(good[i][1] > good[i - 1][1]);
  // Each row has its name before the bars and its words 6 px behind its own, where it has none,
  // too.
  const auto names =
      numbers_of(svg, "<text x=\"([^\"]*)\" y=\"([^\"]*)\" text-anchor=\"end\">method</text>");
  const auto words = numbers_of(
      svg, "<text x=\"([^\"]*)\" y=\"([^\"]*)\" font-size=\"11\" fill=\"#6b7280\">words</text>");
  REQUIRE((names.size() == 6 && words.size() == 6));
  const double left = good[0][0],
               ends[] = {
                   left + bars[0][2], left + bars[1][2], left + good[0][2], left + good[1][2], left,
                   left + good[2][2]};
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(names[i][0] == left - 8);
    CHECK(words[i][0] == Approx(ends[i] + 6).margin(0.02));
    CHECK(names[i][1] == names[0][1] + 18 * static_cast<double>(i));
    CHECK(words[i][1] == names[i][1] - 1);
  }
  CHECK((bars[0][1] < names[0][1] && names[0][1] < bars[0][1] + bars[0][3]));
  // A line at each power of ten, as long as the rows are high.
  const auto lines = numbers_of(svg,
                                "<line x1=\"([^\"]*)\" y1=\"([^\"]*)\" x2=\"([^\"]*)\" "
                                "y2=\"([^\"]*)\" stroke=\"#e5e7eb\"");
  REQUIRE(lines.size() == 5);  // 1e-4 to 1
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(lines[i][0] == Approx(ends[0] + decade * static_cast<double>(i)).margin(0.02));
    CHECK(lines[i][2] == lines[i][0]);
    CHECK((lines[i][1] <= bars[0][1] && lines[i][3] > good[2][1]));
    CHECK(lines[i][3] - lines[i][1] == 6 * 18 + 4);
  }
  for (const auto& [value, bar] : {std::pair(0.5, 1), std::pair(1e-300, 0), std::pair(1e300, 1)}) {
    const std::string one = sim::svg(sim::BarChart{.bars = {{"m", "", value}}, .mark = 0.5});
    CHECK(one.find("nan") == std::string::npos);
    CHECK((one.find("#15803d") != std::string::npos) == (bar == 1));
  }
}

TEST_CASE("every mark of an axis stands where its number says, and so does every point",
          "[output]") {
  struct Case {
    double t0, t1, low, high;
    bool from_zero;
  };
  for (const Case& each :
       {Case{0, 7, 0, 1, true}, Case{-3, 5, -2, 6, true}, Case{0.25, 0.75, 100, 130, false},
        Case{1000, 1300, -0.02, -0.01, false}, Case{0, 1e-3, 2, 5, true}, Case{0, 14, -50, 0, true},
        Case{2, 2, 3, 3, false}, Case{0, 20, -7, -1, true}}) {
    INFO(each.t0 << " .. " << each.t1 << ", " << each.low << " .. " << each.high);
    sim::TimeChart chart;
    chart.title = "t & u", chart.y_name = "y [m]", chart.x_name = "x [s]";
    chart.from_zero = each.from_zero;
    const double middle = 0.5 * (each.t0 + each.t1);
    // Values that are not finite are no points, at either end of a curve or between others.
    chart.curves = {{"up",
                     {{each.t0, each.low},
                      {middle, HUGE_VAL},
                      {std::nan(""), each.high},
                      {each.t1, each.high}}},
                    {"down", {{each.t0, each.high}, {each.t1, each.low}, {each.t1, std::nan("")}}}};
    const std::string svg = sim::svg(chart);
    for (const char* words : {">t &amp; u<", ">y [m]<", ">x [s]<", ">up<", ">down<"})
      CHECK(svg.find(words) != std::string::npos);

    // The paths say where two times and two values stand.
    const auto paths =
        numbers_of(svg, "<path d=\"M([-0-9.]+) ([-0-9.]+)L?([-0-9.]*) ?([-0-9.]*)\"");
    REQUIRE(paths.size() == 2);
    REQUIRE(paths[0].size() == 4);
    const double left = paths[0][0], right = paths[0][2], below = paths[0][1], above = paths[0][3];
    CHECK(paths[1] == std::vector<double>{left, above, right, below});
    CHECK(left == (each.t1 > each.t0 ? 74 : 427));
    CHECK(right == (each.t1 > each.t0 ? 780 : 427));
    // The axis leaves 4 % of the range free on both sides; the range holds 0 where it must.
    const double least = each.from_zero ? std::min(0.0, each.low) : each.low,
                 most = each.from_zero ? std::max(0.0, each.high) : each.high;
    const auto height = [&](double y) {
      if (most == least) return 189.0;
      const double room = 0.04 * (most - least);
      return 330 + (48 - 330) * (y - (least - room)) / (most - least + 2 * room);
    };
    CHECK(below == Approx(height(each.low)).margin(0.0051));
    CHECK(above == Approx(height(each.high)).margin(0.0051));

    // Below the axis of time: a mark of 5 px, and its number 20 px under the floor.
    const auto ticks = numbers_of(svg,
                                  "<line x1=\"([-0-9.]+)\" y1=\"([-0-9.]+)\" x2=\"([-0-9.]+)\" "
                                  "y2=\"([-0-9.]+)\" stroke=\"#9ca3af\"/>\n"
                                  "<text x=\"([-0-9.]+)\" y=\"350\" text-anchor=\"middle\">"
                                  "([-+0-9.e]+)</text>");
    // Across: a line of the whole width, darker at 0, and its number before it.
    const auto lines = numbers_of(svg,
                                  "<line x1=\"74\" y1=\"([-0-9.]+)\" x2=\"780\" y2=\"([-0-9.]+)\" "
                                  "stroke=\"#(?:e5e7eb|9ca3af)\"/>\n"
                                  "<text x=\"66\" y=\"([-0-9.]+)\" text-anchor=\"end\">"
                                  "([-+0-9.e]+)</text>");
    if (each.t1 > each.t0) {
      REQUIRE(ticks.size() >= 3);
      REQUIRE(lines.size() >= 3);
      CHECK((ticks.size() <= 8 && lines.size() <= 8));
      const double step = ticks[1][5] - ticks[0][5], up = lines[1][3] - lines[0][3];
      for (const double size : {step, up}) {
        const double mantissa = size / std::pow(10, std::floor(std::log10(size * 1.0000001)));
        CHECK((mantissa == Approx(1) || mantissa == Approx(2) || mantissa == Approx(5)));
      }
      for (std::size_t i = 0; i < ticks.size(); ++i) {
        const std::vector<double>& tick = ticks[i];
        CHECK(tick[5] == Approx(ticks[0][5] + static_cast<double>(i) * step).margin(1e-9 * step));
        const double at = 74 + 706 * (tick[5] - each.t0) / (each.t1 - each.t0);
        for (const int x : {0, 2, 4})
          CHECK(tick[static_cast<std::size_t>(x)] == Approx(at).margin(0.0051));
        CHECK((tick[1] == 330 && tick[3] == 335));
      }
      for (std::size_t i = 0; i < lines.size(); ++i) {
        const std::vector<double>& line = lines[i];
        CHECK(line[3] == Approx(lines[0][3] + static_cast<double>(i) * up).margin(1e-9 * up));
        CHECK(line[0] == Approx(height(line[3])).margin(0.0051));
        CHECK(line[1] == line[0]);
        CHECK(line[2] == Approx(line[0] + 4.5).margin(0.011));
      }
      // None is missing at either end.
      CHECK((ticks[0][5] >= each.t0 && ticks[0][5] - step < each.t0 - 1e-9 * step));
      CHECK((ticks.back()[5] <= each.t1 && ticks.back()[5] + step > each.t1 + 1e-9 * step));
      CHECK((height(lines[0][3]) <= 330 && height(lines[0][3] - up) > 330));
      CHECK((height(lines.back()[3]) >= 48 && height(lines.back()[3] + up) < 48));
      const auto dark =
          numbers_of(svg, "<line x1=\"74\" y1=\"([-0-9.]+)\" x2=\"780\" [^>]*#9ca3af");
      CHECK(dark.size() == (lines[0][3] <= 0 && lines.back()[3] >= 0 ? 1 : 0));
      if (!dark.empty()) CHECK(dark[0][0] == Approx(height(0)).margin(0.0051));
    }
  }
  sim::TimeChart empty;
  CHECK(sim::svg(empty).find(">no points<") != std::string::npos);
  empty.curves = {{"a", {{0, std::nan("")}, {HUGE_VAL, 1}}}};
  CHECK(sim::svg(empty).find(">no points<") != std::string::npos);
  CHECK(sim::svg(empty).find("<path") == std::string::npos);
}

TEST_CASE("of a long curve the points at equal distances are shown, and its end", "[output]") {
  for (const std::size_t count : {1u, 2u, 1499u, 1500u, 1501u, 2999u, 3000u, 3001u, 4600u}) {
    sim::TimeChart chart;
    chart.curves.resize(1);
    for (std::size_t i = 0; i < count; ++i)
      chart.curves[0].points.emplace_back(i, i % 7 == 0 ? 1 : 0);
    const std::string svg = sim::svg(chart);
    const std::size_t begin = svg.find("<path d=\"");
    const std::string path = svg.substr(begin, svg.find('"', begin + 9) - begin);
    const auto points = static_cast<std::size_t>(std::ranges::count(path, 'L') + 1);
    INFO(count << " points, " << points << " shown");
    // At most 1500 and the last.
    const std::size_t stride = count / 1500 + 1;
    CHECK(points == (count - 1) / stride + 1 + ((count - 1) % stride != 0));
    CHECK(points <= 1501);
    if (count > 1) CHECK(path.find("L780 ") != std::string::npos);
  }
}
