#include "core/output/svg_parts.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/base/text.h"
#include "core/output/page/markup.h"

namespace sim::svg_parts {

const char* curve_colour(std::size_t i) {
  static constexpr const char* kColours[] = {"#c2410c", "#15803d", "#1d4ed8", "#7e22ce",
                                             "#b45309", "#0e7490", "#be185d", "#111827"};
  return kColours[i % std::size(kColours)];
}

std::string number(double value) { return brief(std::round(100 * value) / 100, 7); }

std::string begin(double width, double height) {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number(width) + "\" height=\"" +
         number(height) + "\" viewBox=\"0 0 " + number(width) + " " + number(height) +
         "\" font-family=\"DejaVu Sans, Verdana, sans-serif\" font-size=\"13\" fill=\"#374151\">\n"
         "<rect width=\"100%\" height=\"100%\" rx=\"6\" fill=\"white\"/>\n";
}

std::string text(double x, double y, const std::string& words, const std::string& more) {
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\"" + more + ">" + markup_text(words) +
         "</text>\n";
}

std::string line(double x1, double y1, double x2, double y2, const std::string& style) {
  return "<line x1=\"" + number(x1) + "\" y1=\"" + number(y1) + "\" x2=\"" + number(x2) +
         "\" y2=\"" + number(y2) + "\" " + style + "/>\n";
}

std::string disc(double x, double y, double r, const std::string& style) {
  return "<circle cx=\"" + number(x) + "\" cy=\"" + number(y) + "\" r=\"" + number(r) + "\" " +
         style + "/>\n";
}

DecadeScale::DecadeScale(const std::vector<double>& values, double begin, double end)
    : from(begin), to(end) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  low = std::log10(*least), high = std::log10(*most);
  const double room = std::max(0.15, 0.03 * (high - low));
  low -= room, high += room;
}

double DecadeScale::at(double value) const {
  return from + (to - from) * (std::log10(value) - low) / (high - low);
}

double DecadeScale::every() const { return std::max(1.0, std::ceil((high - low) / 9)); }

std::string decade(double x, double y, double exponent, const std::string& anchor) {
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" text-anchor=\"" + anchor +
         "\">10<tspan dy=\"-5\" font-size=\"9.5\">" + brief(exponent) + "</tspan></text>\n";
}

double width_of(const std::string& words) { return 7.9 * static_cast<double>(words.size()); }

void Places::take(double x, double y, double half_width, double half_height) {
  boxes_.push_back({x, y, half_width, half_height});
}

double Places::crowd(double x, double y, double half_width, double half_height) const {
  double sum = 0;
  for (const Box& box : boxes_) {
    const double w = half_width + box.half_width - std::abs(x - box.x),
                 h = half_height + box.half_height - std::abs(y - box.y);
    if (w > 0 && h > 0)
      sum += std::min(w, 2 * std::min(half_width, box.half_width)) *
             std::min(h, 2 * std::min(half_height, box.half_height));
  }
  return sum;
}

double Places::beside(double x, double y, const std::string& words, double least, double most) {
  const double half = 0.5 * width_of(words);
  double best = y;
  for (int i = 0; i < 120; ++i) {
    const double at = y + (i % 2 ? 1 : -1) * 2.0 * ((i + 1) / 2);
    if (at < least || at > most || crowd(x + half, at, half, 6.5) > 0) continue;
    best = at;
    break;
  }
  take(x + half, best, half, 6.5);
  return best;
}

}  // namespace sim::svg_parts
