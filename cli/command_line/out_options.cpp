#include "cli/command_line/out_options.h"

#include <CLI/CLI.hpp>

#include "cli/command_line/option_values.h"

namespace sim::cli {

std::vector<CLI::Option*> add_out_options(CLI::App& app, OutTexts& t) {
  const auto value = [&](const char* name, std::string& text, const char* type, const char* doc) {
    return app.add_option(name, text, doc)->type_name(type);
  };
  const auto values = [&](const char* name, std::vector<std::string>& texts, const char* type,
                          const char* doc) {
    return app.add_option(name, texts, doc)->type_name(type)->allow_extra_args(false);
  };
  return {
      values("--out", t.files, "FILE",
             "picture, film, page or data, by its ending:\n'sim list writers'; repeatable"),
      value("--fps", t.fps, "N", "frames of --out in a second, instead of --every;\n30 in films"),
      app.add_flag("--show", t.show, "draw the run in the terminal, in its own time")
          ->disable_flag_override(),
      value("--color", t.color, "WHAT",
            "strain, speed, energy, error or mode (the\nfastest), up to a value: strain:0.1"),
      values("--springs", t.springs, "I", "draw springs: of a particle, a family, or all"),
      values("--trail", t.trails, "I", "the way of a particle, of body:I, or none"),
      app.add_flag("--wireframe", t.wireframe, "draw only the lines of surfaces")
          ->disable_flag_override(),
      app.add_flag("--surface", t.surface, "draw water and other loose particles as a\nsurface")
          ->disable_flag_override(),
      value("--camera", t.camera, "TEXT", "\"eye=x,y,z at=x,y,z up=x,y,z fov=30\", or parts"),
      value("--size", t.size, "WxH", "pixels of a picture; 1280x720 if not given")};
}

std::string one_file(const OutTexts& texts, const std::string& ending, const std::string& rule) {
  if (texts.files.size() > 1)
    usage_error("given twice", "--out " + texts.files[1], "it makes one file", "keep one");
  if (texts.files.empty()) return "";
  if (!texts.files.front().ends_with(ending))
    usage_error("bad value", "--out '" + texts.files.front() + "'", rule, "as in name" + ending);
  return texts.files.front();
}

OutRequest out_request(const OutTexts& t, std::optional<std::int64_t> every) {
  OutRequest request;
  request.files = t.files;
  request.every = every;
  if (!t.fps.empty()) request.fps = positive_number("--fps", t.fps);
  if (request.fps && (*request.fps > 1e6 || *request.fps < 1e-6))
    usage_error("bad value", "--fps " + t.fps, "it is out of range", "as in --fps 30");
  if (request.fps && every)
    usage_error("two choices of frames", "--every and --fps", "only one can hold", "keep one");
  request.look = {t.camera, t.color, t.size, t.springs, t.wireframe, t.surface, t.trails};
  // Parsed for its errors; only the scene knows all colours.
  LookSpec look = request.look;
  look.color.clear();
  make_look(look);
  const bool looks = !t.fps.empty() || !request.look.empty();
  request.show = t.show;
  if (looks && !request.any())
    usage_error("nothing to draw",
                "--fps, --color, --springs, --trail, --wireframe, --surface, --camera or --size",
                "they say how files look, and there is none", "add --out last.png");
  return request;
}

}  // namespace sim::cli
