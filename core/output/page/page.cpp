#include "core/output/page/page.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <utility>

#include "core/base/md5.h"
#include "core/output/bytes.h"
#include "core/output/deflate.h"
#include "core/output/format.h"
#include "core/output/page/markup.h"
#include "core/picture/scenery.h"
#include "core/picture/trail.h"

namespace sim {
namespace {

constexpr char kPage[] =
#include "core/output/page/viewer.inc"
    ;  // NOLINT
constexpr char kLive[] =
#include "core/output/page/live.inc"
    ;  // NOLINT

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
  return std::isfinite(value) ? brief(value, digits) : "null";
}

std::string numbers(const std::vector<double>& values, int digits = 7) {
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(number(value, digits));
  return json_array(texts);
}

// "#2458c8"
std::string colour_text(unsigned colour) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text = "#";
  for (int shift = 20; shift >= 0; shift -= 4) text += kDigits[colour >> shift & 15];
  return text;
}

std::string point(const V3& p) { return numbers(std::vector<double>{p.x, p.y, p.z}); }

void append_structure(const Model& model, std::string& data) {
  for (const auto& t : model.triangles) append_bytes(data, std::span<const int>(t));
  for (const ModelFamily& family : model.families) {
    for (const auto& ends : family.ends) append_bytes(data, std::span<const int>(ends));
    for (const double rest : family.rest) append_bytes(data, static_cast<float>(rest));
  }
}

// The particles that something else is drawn for than triangles between them: the first of a row
// and their number, row after row.
std::string covered_json(const Model& model) {
  const std::vector<bool> covered = model.in_triangles();
  std::vector<double> rows;
  for (std::size_t i = 0; i < covered.size(); ++i) {
    if (!covered[i]) continue;
    if (i > 0 && covered[i - 1])
      ++rows.back();
    else
      rows.insert(rows.end(), {static_cast<double>(i), 1});
  }
  return numbers(rows, 9);
}

double ball_radius(const Model& model) {
  const auto covered = model.in_triangles();
  const auto loose = std::ranges::count(covered, false);
  return std::min(0.04, 0.25 / std::cbrt(static_cast<double>(std::max<long>(1, loose))));
}

// Positions as floats, three a particle; what is not finite is at the origin.
std::vector<float> drawable(std::vector<float> points) {
  for (float& x : points)
    if (!(std::abs(x) < 1e4F)) x = 0;
  return points;
}

}  // namespace

// Whole numbers of 16 bits for the points that were added.
struct Page::Box {
  float low[3] = {1e9F, 1e9F, 1e9F}, high[3] = {-1e9F, -1e9F, -1e9F};
  double quantum = 0;

  void add(const std::vector<float>& points) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      low[i % 3] = std::min(low[i % 3], points[i]);
      high[i % 3] = std::max(high[i % 3], points[i]);
    }
    float extent = 1e-6F;
    for (std::size_t axis = 0; axis < 3; ++axis) extent = std::max(extent, high[axis] - low[axis]);
    quantum = static_cast<double>(extent) / 65535;
  }
  std::uint16_t operator()(const std::vector<float>& points, std::size_t i) const {
    return static_cast<std::uint16_t>(
        std::lround((static_cast<double>(points[i]) - low[i % 3]) / quantum) - 32768);
  }
};

Page::Page(std::span<const Model> models, const Moments& moments, const Look& look)
    : models_(models),
      moments_(moments),
      look_(look),
      view_(make_viewpoint(models, moments, look)),
      scale_(colour_scale(look, models, moments)) {
  basis_ = view_.ground ? *view_.ground : Ground{};
}

std::string page_policy(const std::string& nonce) {
  const std::string own = "'nonce-" + nonce + "'";
  return "default-src 'none'; script-src " + own + "; style-src " + own +
         "; img-src data:; base-uri 'none'; form-action 'none'";
}

std::string Page::of_live(const std::string& live, const std::string& nonce) const {
  Page start = *this;
  Moment room;
  const Moment& first = moments_.at(0, room);
  start.moments_ = Moments(&first, 1);
  return start.made(live, nonce, std::numeric_limits<std::size_t>::max());
}

// A page that is written has a digest of what it shows as its nonce.
std::string Page::made(const std::string& live, std::string nonce, std::size_t most) const {
  // A file is kept; a live page goes to this machine, and somebody waits for it.
  const bool file = live == "null";
  Deflater data(file ? 9 : 1, most / 4 * 3);
  std::vector<Box> boxes;
  std::string models, structure;
  for (std::size_t m = 0; m < models_.size(); ++m) {
    append_structure(models_[m], structure);
    data.add(std::exchange(structure, {}));
    boxes.push_back(box_of(m));
    models += (m ? "," : "") + model_json(m, boxes[m]);
  }
  for (std::size_t m = 0; m < models_.size(); ++m) append_positions(m, boxes[m], data);
  if (data.full()) return "";
  std::vector<double> times;
  for (std::size_t at = 0; at < moments_.size(); ++at) times.push_back(moments_.head(at, 0).t);
  JsonObject head;
  head.json("models", "[" + models + "]").json("t", numbers(times));
  head.json("camera", camera_json()).json("light", point(own_axes(view_.light)));
  head.json("scale", number(view_.scale, 12));
  head.json("axes", json_array(std::vector{point(basis_.u), point(basis_.up), point(basis_.w)}));
  head.json("ground", view_.ground ? number(own_axes(view_.ground->origin).y) : "null");
  head.json("grid", number(view_.grid * view_.scale)).json("live", live);
  const bool own = look_.colour == "strain" || look_.colour == "speed";
  if (look_.surface) head.flag("surface", true);
  head.text("colour", measured() ? scale_.name : own ? look_.colour : "plain");
  if (measured())
    head.json("values", JsonObject()
                            .text("name", scale_.name)
                            .text("unit", scale_.unit)
                            .json("most", number(scale_.most))
                            .flag("both", scale_.both_signs)
                            .str());

  const std::string words = script_json(head.str());
  const std::string packed = base64(data.finish());
  std::string policy;
  if (file) {
    nonce = md5(words + packed);
    policy = "<meta http-equiv=\"Content-Security-Policy\" content=\"" +
             markup_text(page_policy(nonce)) + "\">";
  }
  return fill_placeholders(kPage, {{"HEAD", words},
                                   {"DATA", packed},
                                   {"LIVE", file ? "" : kLive},
                                   {"NONCE", nonce},
                                   {"POLICY", policy}});
}

std::string Page::frame(const Moment& moment, std::string words, const ColourScale* scale) const {
  words.append((4 - words.size() % 4) % 4, ' ');
  std::string bytes;
  append_bytes(bytes, static_cast<std::uint32_t>(words.size()));
  bytes += words;
  for (std::size_t m = 0; m < models_.size(); ++m) {
    const auto n = static_cast<std::size_t>(models_[m].particles);
    const std::vector<float> points = points_of(m, moment);
    Box box;
    box.add(points);
    for (const float low : box.low) append_bytes(bytes, low);
    append_bytes(bytes, static_cast<float>(box.quantum));
    const std::size_t begin = bytes.size();
    bytes.resize(begin + 6 * n);
    for (std::size_t i = 0; i < 3 * n; ++i) {
      const std::uint16_t q = box(points, i);
      bytes[begin + 2 * i] = static_cast<char>(q & 255U);
      bytes[begin + 2 * i + 1] = static_cast<char>(q >> 8);
    }
    if (scale) append_values(m, moment, *scale, bytes);
    bytes.append((4 - bytes.size() % 4) % 4, '\0');
  }
  return bytes;
}

std::vector<float> Page::points_of(std::size_t m, const Moment& moment) const {
  std::vector<float> points;
  points.reserve(3 * static_cast<std::size_t>(models_[m].particles));
  for (int i = 0; i < models_[m].particles; ++i) {
    const V3 p = own_axes(view_.point(moment[m].at(i) + view_.offsets[m]));
    points.insert(points.end(), {p.x, p.y, p.z});
  }
  return drawable(std::move(points));
}

std::string Page::solids(const Moment& moment, std::size_t system) const {
  Page now = *this;
  now.moments_ = Moments(&moment, 1);
  return now.solids_json(system);
}

// In the page y is up, and z is towards the eye.
V3 Page::own_axes(const V3& p) const {
  return {dot(p, basis_.u), dot(p, basis_.up), dot(p, basis_.w)};
}

std::string Page::camera_json() const {
  const V3 eye = own_axes(view_.eye.at), forward = own_axes(view_.eye.forward);
  const float distance = std::max(0.05F, -dot(eye, forward));
  const V3 at = eye + distance * forward;
  const double flat = std::hypot(forward.x, forward.z);
  JsonObject camera;
  camera.json("at", point(at)).json("distance", number(distance));
  camera.json("yaw", number(std::atan2(-forward.x, -forward.z)));
  camera.json("pitch", number(std::atan2(-forward.y, flat)));
  camera.json("focal", number(view_.eye.focal));
  camera.json("aspect", number(static_cast<double>(look_.width) / look_.height));
  return camera.str();
}

// The points that leave chosen trails, as particles with their weights, in which colour; and their
// paths, with the number of points up to each moment.
std::string Page::trails_json(std::size_t m) const {
  const std::vector<Trail> trails = trails_of(models_[m], look_);
  if (trails.empty()) return "";
  std::vector<std::string> list;
  for (std::size_t k = 0; k < trails.size(); ++k) {
    std::vector<double> points, ends, ids;
    for (std::size_t at = 0; at < moments_.size(); ++at) {
      const Frame& frame = moments_.head(at, m);
      if (k < frame.paths.size())
        for (const Vec3& x : frame.paths[k]) {
          const V3 p = own_axes(view_.point(x + view_.offsets[m]));
          points.insert(points.end(), {p.x, p.y, p.z});
        }
      ends.push_back(static_cast<double>(points.size() / 3));
    }
    for (int i = 0; i < trails[k].point.count; ++i)
      ids.push_back(trails[k].point.ids[static_cast<std::size_t>(i)]);
    list.push_back(JsonObject()
                       .text("colour", colour_text(trails[k].colour))
                       .json("ids", numbers(ids))
                       .json("ends", numbers(ends, 9))
                       .json("points", numbers(points, 5))
                       .str());
  }
  return json_array(list);
}

// The torn pairs at each moment, as one list of ids; empty where there are none at all.
std::string Page::tears_json(std::size_t m) const {
  std::vector<std::string> all;
  bool any = false;
  for (std::size_t at = 0; at < moments_.size(); ++at) {
    const Frame& frame = moments_.head(at, m);
    any = any || !frame.torn.empty();
    all.push_back(torn_json(frame));
  }
  return any ? json_array(all) : "";
}

std::string torn_json(const Frame& frame) {
  std::vector<std::string> ids;
  for (const auto& [a, b] : frame.torn) {
    ids.push_back(std::to_string(a));
    ids.push_back(std::to_string(b));
  }
  return json_array(ids);
}

std::string Page::model_json(std::size_t m, const Box& box) const {
  const Model& model = models_[m];
  JsonObject json;
  json.text("name", model.name).text("method", model.method);
  json.json("h", number(model.h)).integer("particles", model.particles);
  json.integer("triangles", static_cast<std::int64_t>(model.triangles.size()));
  const std::vector<int> grid(model.grid.begin(), model.grid.end());
  json.json("grid", numbers({grid.begin(), grid.end()}));
  json.json("covered", covered_json(model));
  json.json("pinned", numbers({model.pinned.begin(), model.pinned.end()}));
  std::vector<std::string> families;
  std::int64_t springs = 0;
  for (const ModelFamily& family : model.families) {
    const auto count = static_cast<std::int64_t>(family.ends.size());
    if (!family.rods) springs += count;
    families.push_back(JsonObject().text("name", family.name).integer("count", count).str());
  }
  json.integer("springs", springs).json("families", json_array(families));
  if (!model.ties.empty()) {
    std::vector<std::string> ends;
    for (const ModelTie& tie : model.ties)
      for (const ModelPoint& end : tie) {
        const auto count = static_cast<std::size_t>(end.count);
        const std::vector<double> ids(end.ids.begin(), end.ids.begin() + end.count);
        ends.push_back(numbers(ids));
        ends.push_back(
            numbers({end.weights.begin(), end.weights.begin() + static_cast<int>(count)}));
      }
    json.json("ties", json_array(ends));
  }
  const Vec3 origin = view_.origin - view_.offsets[m];
  json.json("origin", numbers(std::vector<double>{origin.x(), origin.y(), origin.z()}, 12));
  json.json("ball", number(ball_radius(model)));
  json.integer("trail", own_trail(model, look_));
  if (const std::string trails = trails_json(m); !trails.empty()) json.json("trails", trails);
  json.json("solids", solids_json(m));
  if (model.second_order) json.json("energy", energy_json(m));
  if (const std::string tears = tears_json(m); !tears.empty()) json.json("tears", tears);
  json.json("low", numbers(std::vector<double>{box.low[0], box.low[1], box.low[2]}, 9))
      .json("quantum", number(box.quantum, 9));
  return json.str();
}

std::string Page::energy_json(std::size_t m) const {
  std::vector<double> kinetic, potential, total;
  for (std::size_t at = 0; at < moments_.size(); ++at) {
    const Frame& frame = moments_.head(at, m);
    kinetic.push_back(frame.kinetic);
    potential.push_back(frame.potential);
    total.push_back(frame.kinetic + frame.potential);
  }
  return JsonObject()
      .json("kinetic", numbers(kinetic, 5))
      .json("potential", numbers(potential, 5))
      .json("total", numbers(total, 5))
      .str();
}

bool Page::measured() const {
  Moment room;
  const Moment& first = moments_.at(0, room);
  for (std::size_t m = 0; m < models_.size(); ++m)
    if (!values_of(m, first, scale_).empty()) return true;
  return false;
}

// The numbers of a lattice, or those that somebody measured.
std::vector<double> Page::values_of(std::size_t m, const Moment& moment,
                                    const ColourScale& scale) const {
  return models_[m].lattice() ? quantity(models_[m], moment[m], scale.name) : moment[m].values;
}

// The poses of solids at a moment, once if they rest. The ground is drawn as such, and of a room
// its edges, for a viewer inside sees through its walls.
std::string Page::solids_json(std::size_t m) const {
  constexpr double kLevel = 0.999999;
  const char* const forms[] = {"", "plane", "sphere", "box", "capsule", "mesh"};
  using Form = RenderShape::Form;
  std::vector<std::string> list;
  std::map<const RigidShape*, std::size_t> meshes;  // the first solid with each
  const auto& first = moments_.head(0, m).solids;
  for (std::size_t s = 0; s < first.size(); ++s) {
    const Form form = first[s].form;
    const bool level = form == Form::kPlane && first[s].axes[1].dot(view_.up) > kLevel;
    const bool room = first[s].inside;
    if (form == Form::kNone || level || (room && form != Form::kBox)) continue;
    std::vector<std::string> places, turns;
    for (std::size_t at = 0; at < moments_.size(); ++at) {
      const RenderShape& solid = moments_.head(at, m).solids[s];
      places.push_back(point(own_axes(view_.point(solid.center + view_.offsets[m]))));
      std::vector<double> turn;
      for (const Vec3& axis : solid.axes) {
        const V3 end = own_axes(view_.point(view_.origin + axis));
        turn.insert(turn.end(), {end.x, end.y, end.z});
      }
      turns.push_back(numbers(turn));
    }
    for (auto* each : {&places, &turns})
      if (std::ranges::adjacent_find(*each, std::not_equal_to()) == each->end()) each->resize(1);
    JsonObject solid;
    solid.text("form", forms[static_cast<int>(form)])
        .json("radius", number(first[s].radius * view_.scale))
        .json("at", json_array(places));
    if (form != Form::kSphere) solid.json("axes", json_array(turns));
    if (first[s].body) solid.json("body", "1");
    if (room) solid.json("room", "1");
    const auto [known, is_new] = meshes.try_emplace(first[s].mesh.get(), list.size());
    if (form == Form::kMesh && !is_new) solid.json("like", std::to_string(known->second));
    if (form == Form::kMesh && is_new) {
      const RigidShape& mesh = *first[s].mesh;
      const auto coordinates = [&mesh](const auto& parts) {
        std::vector<double> flat;
        for (const auto& part : parts)
          for (const int i : part)
            for (const double x : mesh.points[static_cast<std::size_t>(i)]) flat.push_back(x);
        return numbers(flat);
      };
      solid.json("mesh", coordinates(mesh.triangles));
      solid.json("edges", coordinates(sharp_edges(mesh)));
    }
    list.push_back(solid.str());
  }
  return json_array(list);
}

// In 255ths of the scale.
void Page::append_values(std::size_t m, const Moment& moment, const ColourScale& scale,
                         std::string& out) const {
  const std::vector<double> values = values_of(m, moment, scale);
  for (int i = 0; i < models_[m].particles; ++i) {
    const double value = values.empty() ? 0 : values[static_cast<std::size_t>(i)] / scale.most;
    const double share = scale.both_signs ? 0.5 + 0.5 * value : value;
    out += static_cast<char>(
        static_cast<unsigned char>(share > 0 ? std::min(255.0, std::round(255 * share)) : 0));
  }
}

Page::Box Page::box_of(std::size_t m) const {
  Box box;
  Moment room;
  for (std::size_t at = 0; at < moments_.size(); ++at) box.add(points_of(m, moments_.at(at, room)));
  return box;
}

// The moments are gone through for each plane of bytes: there may be more than memory holds.
void Page::append_positions(std::size_t m, const Box& box, Deflater& data) const {
  const std::size_t n = 3 * static_cast<std::size_t>(models_[m].particles);
  Moment room;
  for (const int shift : {0, 8}) {
    std::vector<std::uint16_t> before(n);
    std::string bytes;
    for (std::size_t at = 0; at < moments_.size() && !data.full(); ++at) {
      const std::vector<float> points = points_of(m, moments_.at(at, room));
      for (std::size_t i = 0; i < n; ++i) {
        const std::uint16_t q = box(points, i);
        const auto d = static_cast<std::uint16_t>(q - std::exchange(before[i], q));
        bytes += static_cast<char>(d >> shift & 255);
      }
      data.add(bytes);
      bytes.clear();
    }
  }
  if (!measured()) return;
  for (std::size_t at = 0; at < moments_.size() && !data.full(); ++at) {
    std::string bytes;
    append_values(m, moments_.at(at, room), scale_, bytes);
    data.add(bytes);
  }
}

}  // namespace sim
