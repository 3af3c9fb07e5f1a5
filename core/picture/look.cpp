#include "core/picture/look.h"

#include <algorithm>
#include <sstream>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim {
namespace {

constexpr int kMostPixels = 8192;

[[noreturn]] void refuse_look(const std::string& option, const std::string& why,
                              const std::string& remedy) {
  throw Error(ErrorKind::kUsage, {"bad value", option, why, remedy});
}

Vec3 read_point(const std::string& text, const std::string& option) {
  Vec3 point{0, 0, 0};
  std::istringstream in(text);
  std::string word;
  int count = 0;
  for (; std::getline(in, word, ','); ++count) {
    const auto number = parse_number(word);
    if (!number || count > 2)
      refuse_look(option, "'" + text + "' is no point", "a point is three numbers: 1,0.5,2");
    point[count] = *number;
  }
  if (count != 3)
    refuse_look(option, "'" + text + "' is no point", "a point is three numbers: 1,0.5,2");
  return point;
}

}  // namespace

const std::vector<std::string>& Look::colours() {
  static const std::vector<std::string> names{"none", "strain", "speed", "energy", "error", "mode"};
  return names;
}

void read_camera(const std::string& text, Look& look) {
  const std::string option = "--camera '" + text + "'",
                    form = "as in \"eye=1,1,3 at=0,0,0 fov=40\"";
  std::istringstream in(text);
  std::string word;
  int count = 0;
  for (; in >> word; ++count) {
    const auto is = word.find('=');
    const std::string name = word.substr(0, is);
    const std::vector<std::string> known{"eye", "at", "up", "fov"};
    if (is == std::string::npos || std::ranges::find(known, name) == known.end())
      refuse_look(option, "'" + name + "' is nothing of a camera", suggestion(name, known));
    const std::string value = word.substr(is + 1);
    if (name == "fov") {
      const auto angle = parse_number(value);
      if (!angle || *angle < 1 || *angle > 150)
        refuse_look(option, "fov is an angle of 1 to 150 degrees", form);
      look.fov = *angle;
    } else {
      (name == "eye" ? look.eye : name == "at" ? look.at : look.up) = read_point(value, option);
    }
  }
  if (count == 0) refuse_look(option, "it says nothing", form);
  if (look.up && !(look.up->norm() > 0)) refuse_look(option, "up has no length", form);
  if (look.eye && look.at && !((*look.eye - *look.at).norm() > 0))
    refuse_look(option, "eye and at are one point", form);
}

void read_colour(const std::string& text, Look& look, const std::vector<std::string>& names) {
  const auto colon = text.find(':');
  look.colour = text.substr(0, colon);
  std::vector<std::string> known = Look::colours();
  known.insert(known.end(), names.begin(), names.end());
  if (std::ranges::find(known, look.colour) == known.end())
    refuse_look("--color '" + text + "'", "nothing is coloured by that",
                suggestion(look.colour, known));
  if (colon == std::string::npos) return;
  const auto most = parse_number(std::string_view(text).substr(colon + 1));
  if (!most || *most <= 0)
    refuse_look("--color '" + text + "'", "the end of the scale is a number > 0",
                "as in strain:0.1");
  look.most = *most;
}

void read_springs(const std::string& text, Look& look) {
  if (text == "all") {
    look.all_springs = true;
  } else if (const auto id = parse_integer(text)) {
    if (*id < 0 || *id > 2'000'000'000)
      refuse_look("--springs " + text, "there is no such particle", "ids start at 0");
    look.picked.push_back(static_cast<int>(*id));
  } else {
    look.families.push_back(text);
  }
}

void read_trail(const std::string& text, Look& look) {
  constexpr std::string_view kBody = "body:";
  look.own_trails = true;
  if (text == "none") return;
  const bool body = text.starts_with(kBody);
  const auto id = parse_integer(std::string_view(text).substr(body ? kBody.size() : 0));
  if (!id || *id < 0 || *id > 2'000'000'000)
    refuse_look("--trail '" + text + "'", "it is no particle and no body",
                "as in --trail 12, --trail body:0 or --trail none");
  look.trails.push_back({body, static_cast<int>(*id)});
}

void read_size(const std::string& text, Look& look) {
  const auto x = text.find('x');
  const auto width = parse_integer(std::string_view(text).substr(0, x));
  const auto height =
      x == std::string::npos ? std::nullopt : parse_integer(std::string_view(text).substr(x + 1));
  if (!width || !height || *width < 16 || *height < 16 || *width > kMostPixels ||
      *height > kMostPixels)
    refuse_look("--size '" + text + "'",
                "a side has 16 to " + std::to_string(kMostPixels) + " pixels", "as in 1280x720");
  look.width = static_cast<int>(*width);
  look.height = static_cast<int>(*height);
}

std::vector<std::string> names_of_field(const SystemSpec& system) {
  std::vector<std::string> names;
  if (!system.first_order) return names;
  const auto& given = system.first_order->field.given;
  const auto list = given.find("names");
  if (list == given.end() || !std::holds_alternative<List>(list->second)) return names;
  for (const auto& entry : std::get<List>(list->second))
    if (const auto* name = std::get_if<std::string>(&entry)) names.push_back(*name);
  return names;
}

std::vector<std::string> names_of_fields(const SceneSpec& scene) {
  std::vector<std::string> names;
  for (const SystemSpec& system : scene.systems) {
    const std::vector<std::string> more = names_of_field(system);
    names.insert(names.end(), more.begin(), more.end());
  }
  return names;
}

Look make_look(const LookSpec& scene, const LookSpec& asked,
               const std::vector<std::string>& names) {
  Look look;
  for (const LookSpec* spec : {&scene, &asked}) {
    if (!spec->camera.empty()) read_camera(spec->camera, look);
    if (!spec->color.empty()) read_colour(spec->color, look, names);
    if (!spec->size.empty()) read_size(spec->size, look);
    look.wireframe = look.wireframe || spec->wireframe;
    look.surface = look.surface || spec->surface;
  }
  for (const std::string& springs : asked.springs.empty() ? scene.springs : asked.springs)
    read_springs(springs, look);
  for (const std::string& trail : asked.trails.empty() ? scene.trails : asked.trails)
    read_trail(trail, look);
  return look;
}

}  // namespace sim
