#include "cli/view/live.h"
#include "core/output/format.h"

namespace sim::cli {

std::string args_json(const std::vector<SceneArg>& args) {
  std::vector<std::string> list;
  const auto put = [](JsonObject& object, const char* key, const Value& value) {
    if (const auto* number = std::get_if<double>(&value))
      object.number(key, *number);
    else if (const auto* flag = std::get_if<bool>(&value))
      object.flag(key, *flag);
    else
      object.text(key, to_text(value));
  };
  for (const SceneArg& arg : args) {
    JsonObject object;
    object.text("name", arg.name).text("doc", arg.doc);
    put(object, "first", arg.default_value);
    put(object, "value", arg.value);
    list.push_back(object.str());
  }
  return json_array(list);
}

}  // namespace sim::cli
