// One page that shows a run in any browser: no network, no library. Positions are whole numbers of
// 16 bits in the box of what moves, as differences from moment to moment, low bytes before high
// ones, deflated.
#include <algorithm>
#include <iostream>

#include "core/base/text.h"
#include "core/output/bytes.h"
#include "core/output/deflate.h"
#include "core/output/format.h"
#include "core/output/output.h"
#include "core/output/writer.h"
#include "core/picture/scenery.h"
#include "core/plugin/plugin.h"

namespace {

constexpr char kPage[] =
#include "core/output/page/viewer.inc"
    ;  // NOLINT
constexpr std::size_t kMostBytes = 50'000'000;

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve(bytes.size() / 3 * 4 + 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k <= bytes.size() ? kDigits[three >> (18 - 6 * k) & 63U] : '=';
  }
  return out;
}

std::string number(double value, int digits = 7) {
  return std::isfinite(value) ? sim::brief(value, digits) : "null";
}

std::string numbers(const std::vector<double>& values, int digits = 7) {
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(number(value, digits));
  return sim::json_array(texts);
}

std::string point(const sim::V3& p) { return numbers(std::vector<double>{p.x, p.y, p.z}); }

// Text as JSON that cannot end the script it stands in.
std::string quoted(const std::string& text) {
  std::string json = sim::json_string(text);
  for (std::size_t at = 0; (at = json.find('<', at)) != std::string::npos;)
    json.replace(at, 1, "\\u003c");
  return json;
}

class Html final : public sim::Writer {
 public:
  explicit Html(const sim::WriterTask& task) : task_(task), output_({task.file}, std::cout) {}

  sim::Pace pace() const override { return sim::Pace::kFilm; }

  void add(const sim::Moment& moment) override {
    moments_.push_back(moment);
    const std::string& colour = task_.look.colour;
    for (std::size_t m = 0; m < moment.size(); ++m) {
      sim::Frame& frame = moments_.back()[m];
      if (colour == "energy") frame.values = sim::quantity(task_.models[m], frame, colour);
      frame.v = {};
    }
  }

  void commit() override {
    if (moments_.empty()) return;
    const sim::Viewpoint view = sim::make_viewpoint(task_.models, moments_, task_.look);
    basis_ = view.ground ? *view.ground : sim::Ground{};
    const sim::ColourScale scale = sim::colour_scale(task_.look, task_.models, moments_);
    const std::string& wanted = task_.look.colour;
    const bool given = wanted == "error" || wanted == "mode" || wanted == "energy";
    measured_ = given ? scale.most : 0;
    std::string data, models, planes;
    for (std::size_t m = 0; m < task_.models.size(); ++m) {
      append_structure(task_.models[m], data);
      models += (m ? "," : "") + model_json(m, view, planes);
    }
    data += planes;
    std::vector<double> times;
    for (const sim::Moment& moment : moments_) times.push_back(moment.front().t);
    sim::JsonObject head;
    head.json("models", "[" + models + "]").json("t", numbers(times));
    head.json("camera", camera_json(view)).json("light", point(own_axes(view.light)));
    head.json("scale", number(view.scale, 12));
    head.json("ground", view.ground ? number(own_axes(view.ground->origin).y) : "null");
    head.json("grid", number(view.grid * view.scale));
    head.text("colour", measured_ > 0                 ? scale.name
                        : task_.look.colour == "none" ? "plain"
                                                      : task_.look.colour);
    if (measured_ > 0)
      head.json("values", sim::JsonObject()
                              .text("name", scale.name)
                              .text("unit", scale.unit)
                              .json("most", number(scale.most))
                              .str());

    std::string page = kPage;
    const std::string packed = base64(sim::deflated(data, 9));
    page.replace(page.find("H=HEAD"), 6, "H=" + head.str());
    page.replace(page.find("text=DATA"), 9, "text=\"" + packed + "\"");
    if (page.size() > kMostBytes)
      throw sim::Error(sim::ErrorKind::kIo,
                       {"a page too large for a browser", task_.file,
                        std::to_string(page.size() / 1'000'000) + " MB, of at most 50",
                        "fewer moments, --fps 10, or a shorter --time"});
    output_.buffer() = std::move(page);
    output_.commit();
  }

 private:
  // In the page y is up, and z is towards the eye.
  sim::V3 own_axes(const sim::V3& p) const {
    return {dot(p, basis_.u), dot(p, basis_.up), dot(p, basis_.w)};
  }

  static void append_structure(const sim::Model& model, std::string& data) {
    for (const auto& t : model.triangles) sim::append_bytes(data, std::span<const int>(t));
    for (const sim::ModelFamily& family : model.families) {
      for (const auto& ends : family.ends) sim::append_bytes(data, std::span<const int>(ends));
      for (const double rest : family.rest) sim::append_bytes(data, static_cast<float>(rest));
    }
  }

  std::string camera_json(const sim::Viewpoint& view) const {
    const sim::V3 eye = own_axes(view.eye.at), forward = own_axes(view.eye.forward);
    const float distance = std::max(0.05F, -dot(eye, forward));
    const sim::V3 at = eye + distance * forward;
    const double flat = std::hypot(forward.x, forward.z);
    sim::JsonObject camera;
    camera.json("at", point(at)).json("distance", number(distance));
    camera.json("yaw", number(std::atan2(-forward.x, -forward.z)));
    camera.json("pitch", number(std::atan2(-forward.y, flat)));
    camera.json("focal", number(view.eye.focal));
    camera.json("aspect", number(static_cast<double>(task_.look.width) / task_.look.height));
    return camera.str();
  }

  std::string model_json(std::size_t m, const sim::Viewpoint& view, std::string& planes) const {
    const sim::Model& model = task_.models[m];
    sim::JsonObject json;
    json.json("name", quoted(model.name)).json("method", quoted(model.method));
    json.json("h", number(model.h)).integer("particles", model.particles);
    json.integer("triangles", static_cast<std::int64_t>(model.triangles.size()));
    const std::vector<int> grid(model.grid.begin(), model.grid.end());
    json.json("grid", numbers({grid.begin(), grid.end()}));
    const bool block = std::ranges::min(grid) > 1 && !model.triangles.empty();
    json.integer("block", block ? grid[0] * grid[1] * grid[2] : 0);
    json.json("pinned", numbers({model.pinned.begin(), model.pinned.end()}));
    std::vector<std::string> families;
    std::int64_t springs = 0;
    for (const sim::ModelFamily& family : model.families) {
      const auto count = static_cast<std::int64_t>(family.ends.size());
      springs += count;
      families.push_back(
          sim::JsonObject().json("name", quoted(family.name)).integer("count", count).str());
    }
    json.integer("springs", springs).json("families", sim::json_array(families));
    const sim::Vec3 origin = view.origin - view.offsets[m];
    json.json("origin", numbers(std::vector<double>{origin.x(), origin.y(), origin.z()}));
    json.json("ball", number(ball_radius(model)));
    json.integer("trail", trailing(model));
    json.json("solids", solids_json(m, view));
    if (model.second_order) json.json("energy", energy_json(m));
    positions(m, view, json, planes);
    return json.str();
  }

  static double ball_radius(const sim::Model& model) {
    const auto covered = model.in_triangles();
    const auto loose = std::ranges::count(covered, false);
    return std::min(0.04, 0.25 / std::cbrt(static_cast<double>(std::max<long>(1, loose))));
  }

  // The particle that leaves a trail, or -1.
  static int trailing(const sim::Model& model) {
    if (!model.triangles.empty() || model.particles - static_cast<int>(model.pinned.size()) > 8)
      return -1;
    int last = model.particles - 1;
    while (last >= 0 && std::ranges::binary_search(model.pinned, last)) --last;
    return last;
  }

  std::string energy_json(std::size_t m) const {
    std::vector<double> kinetic, potential, total;
    for (const sim::Moment& moment : moments_) {
      kinetic.push_back(moment[m].kinetic);
      potential.push_back(moment[m].potential);
      total.push_back(moment[m].kinetic + moment[m].potential);
    }
    return sim::JsonObject()
        .json("kinetic", numbers(kinetic, 5))
        .json("potential", numbers(potential, 5))
        .json("total", numbers(total, 5))
        .str();
  }

  // Balls alone: where they are in each moment, once if they rest.
  std::string solids_json(std::size_t m, const sim::Viewpoint& view) const {
    std::vector<std::string> list;
    const auto& first = moments_.front()[m].solids;
    for (std::size_t s = 0; s < first.size(); ++s) {
      if (first[s].form != sim::SolidShape::Form::kSphere || first[s].inside) continue;
      std::vector<std::string> places;
      for (const sim::Moment& moment : moments_)
        places.push_back(point(own_axes(view.point(moment[m].solids[s].center + view.offsets[m]))));
      if (std::ranges::adjacent_find(places, std::not_equal_to()) == places.end()) places.resize(1);
      list.push_back(sim::JsonObject()
                         .json("radius", number(first[s].radius * view.scale))
                         .json("at", sim::json_array(places))
                         .str());
    }
    return sim::json_array(list);
  }

  void positions(std::size_t m, const sim::Viewpoint& view, sim::JsonObject& json,
                 std::string& planes) const {
    std::vector<float> points;
    for (const sim::Moment& moment : moments_)
      for (int i = 0; i < task_.models[m].particles; ++i) {
        const sim::V3 p = own_axes(view.point(moment[m].at(i) + view.offsets[m]));
        for (const float x : {p.x, p.y, p.z}) points.push_back(std::abs(x) < 1e4F ? x : 0);
      }
    float low[3] = {1e9F, 1e9F, 1e9F}, extent = 1e-6F;
    for (std::size_t i = 0; i < points.size(); ++i) low[i % 3] = std::min(low[i % 3], points[i]);
    for (std::size_t i = 0; i < points.size(); ++i)
      extent = std::max(extent, points[i] - low[i % 3]);
    const double quantum = static_cast<double>(extent) / 65535;
    json.json("low", numbers(std::vector<double>{low[0], low[1], low[2]}, 9))
        .json("quantum", number(quantum, 9));
    const std::size_t n = 3 * static_cast<std::size_t>(task_.models[m].particles);
    std::vector<std::uint16_t> q(points.size());
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = static_cast<std::uint16_t>(
          static_cast<int>((static_cast<double>(points[i]) - low[i % 3]) / quantum + 0.5) - 32768);
    std::string lows, highs;
    for (std::size_t i = 0; i < q.size(); ++i) {
      const auto d = static_cast<std::uint16_t>(i < n ? q[i] : q[i] - q[i - n]);
      lows += static_cast<char>(d & 255U);
      highs += static_cast<char>(d >> 8);
    }
    planes += lows + highs;
    if (measured_ > 0) append_values(m, planes);
  }

  // What somebody else measured, in 255ths of the scale.
  void append_values(std::size_t m, std::string& planes) const {
    for (const sim::Moment& moment : moments_)
      for (int i = 0; i < task_.models[m].particles; ++i) {
        const auto& values = moment[m].values;
        const double value = values.empty() ? 0 : values[static_cast<std::size_t>(i)] / measured_;
        planes += static_cast<char>(
            static_cast<unsigned char>(value > 0 ? std::min(255.0, 255 * value + 0.5) : 0));
      }
  }

  sim::WriterTask task_;
  sim::Output output_;
  sim::Ground basis_;
  double measured_ = 0;  // the end of the scale of what somebody else measured, or 0
  std::vector<sim::Moment> moments_;
};

}  // namespace

SIM_PLUGIN(Writer, "html") {
  registrar.add(sim::Plugin<sim::Writer>{
      {.name = "html",
       .summary = "a page for any browser: play, scrub, turn, pick a particle, energies",
       .formula = "--out run.html --fps 30"},
      [](const sim::Params&, const sim::WriterTask& task) {
        return std::make_unique<Html>(task);
      }});
}
