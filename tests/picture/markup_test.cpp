// Text of a stranger in pages and charts: it is shown, and is nothing but text.
#include "core/output/page/markup.h"

#include <catch2/catch.hpp>

#include "core/output/page/live_page.h"
#include "core/output/svg.h"
#include "tests/support/scenes.h"

namespace {

const std::string kHostile =
    "</script><script>pwned()</script><!--<script> \" ' & @SOCKET@ @HEAD@ @DATA@ @LIVE@ text=DATA "
    "H=HEAD /*LIVE*/ \xe2\x80\xa8 \xe2\x80\xa9 \x1b]0;x\x07 \\";

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; ++at) ++found;
  return found;
}

// A page in which everything that a scene names has that name.
std::string live_page(const std::string& name) {
  sim::Registry registry = sim_test::make_registry();
  const sim::SystemSpec spec = sim_test::make_cloth(3);
  sim::Simulation system(spec, registry);
  std::vector<sim::Model> models{sim::make_model(spec, system)};
  models[0].name = models[0].method = name;
  for (sim::ModelFamily& family : models[0].families) family.name = name;
  const std::vector<sim::Moment> moments{{sim::take_frame(system)}};
  sim::ViewScene scene{.models = models, .preview = moments, .methods = {name}};
  scene.args = {{.name = "a", .default_value = name, .value = name, .doc = name}};
  return sim::LivePage(scene, false).html("/socket", "nonce");
}

}  // namespace

TEST_CASE("text of a scene ends no script of a page and is no placeholder") {
  const std::string page = live_page(kHostile), plain = live_page("plain");
  for (const char* const part : {"<script", "</script", "<!--", "\xe2\x80\xa8", "\xe2\x80\xa9"}) {
    INFO(part);
    CHECK(count(page, part) == count(plain, part));
  }
  for (const char* const part :
       {"@SOCKET@", "@HEAD@", "@DATA@", "@LIVE@", "text=DATA", "/*LIVE*/"}) {
    INFO(part);
    CHECK(count(page, part) == 3 + 2 + 1 + 3);  // families, name and method, methods, an argument
    CHECK(count(plain, part) == 0);
  }
  CHECK(count(plain, "@") == count(plain, "@media"));
  CHECK(count(page, "\"socket\":\"/socket\"") == 1);
}

TEST_CASE("placeholders are filled in one pass") {
  using sim::fill_placeholders;
  CHECK(fill_placeholders("a @X@ b @Y@", {{"X", "@Y@"}, {"Y", "@X@"}}) == "a @Y@ b @X@");
  CHECK(fill_placeholders("@ @Z@ @X@@X@", {{"X", "1"}}) == "@ @Z@ 11");
  CHECK(fill_placeholders("", {}).empty());
  CHECK(fill_placeholders("@", {{"", "1"}}) == "@");
}

TEST_CASE("text between tags and in attributes is well formed") {
  using sim::markup_text;
  CHECK(markup_text("<a b=\"c\" d='e'>&amp;") ==
        "&lt;a b=&quot;c&quot; d=&#39;e&#39;&gt;&amp;amp;");
  CHECK(markup_text("\x1b[1m\a\r\x7f\xc2\x9b\t\n") == "\\x1b[1m\\x07\\x0d\\x7f\\xc2\\x9b\t\n");
  CHECK(markup_text("gr\xc3\xbcn \xe2\x82\xac \xf0\x9f\x98\x80") ==
        "gr\xc3\xbcn \xe2\x82\xac \xf0\x9f\x98\x80");
  CHECK(markup_text("\xff\xc3(\xe2\x82\xed\xa0\x80\xef\xbf\xbf\xf4\x90\x80\x80\xc0\x80") ==
        "\\xff\\xc3(\\xe2\\x82\\xed\\xa0\\x80\\xef\\xbf\\xbf\\xf4\\x90\\x80\\x80\\xc0\\x80");
}

TEST_CASE("a chart of hostile names is well formed") {
  sim::TimeChart chart;
  chart.title = chart.y_name = kHostile;
  chart.curves = {{.name = kHostile, .points = {{0, 1}, {1, 2}}}};
  const std::string text = sim::svg(chart);
  CHECK(count(text, "<script") == 0);
  CHECK(count(text, "</script") == 0);
  CHECK(count(text, "\x1b") == 0);
  CHECK(count(text, "<text") == count(text, "</text>"));
}
