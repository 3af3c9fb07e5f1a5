#include "core/lua/scene/argument_units.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/lua/dimension.h"
#include "core/lua/lua_keywords.h"

namespace sim {
namespace {

struct Token {
  enum class Kind { kName, kKeyword, kText, kNumber, kSymbol, kEnd };
  Kind kind = Kind::kEnd;
  std::string_view text = {};  // of a text: the part between its quotes
  int line = 0;

  bool is(std::string_view symbol) const {
    return (kind == Kind::kSymbol || kind == Kind::kKeyword) && text == symbol;
  }
};

// The text is a chunk that Lua has compiled: nothing in it is left open.
class Lexer {
 public:
  explicit Lexer(const std::string& text) : text_(text) {}

  std::vector<Token> tokens() {
    std::vector<Token> all;
    while (all.empty() || all.back().kind != Token::Kind::kEnd) all.push_back(next());
    return all;
  }

 private:
  std::string_view slice(std::size_t begin, std::size_t end) const {
    return begin < end ? std::string_view(text_).substr(begin, end - begin) : std::string_view();
  }
  char at(std::size_t i) const { return i < text_.size() ? text_[i] : '\0'; }
  bool ended() const { return at_ >= text_.size(); }
  void advance() { line_ += text_[at_++] == '\n'; }

  // [[, [=[, ..: the number of signs between the brackets, or nothing.
  std::optional<std::size_t> long_bracket() const {
    std::size_t signs = 0;
    while (at(at_ + 1 + signs) == '=') ++signs;
    return at(at_) == '[' && at(at_ + 1 + signs) == '[' ? std::optional(signs) : std::nullopt;
  }
  std::string_view long_text(std::size_t signs) {
    const std::string closing = "]" + std::string(signs, '=') + "]";
    const std::size_t begin = at_ + 2 + signs;
    const std::size_t end = std::min(text_.find(closing, begin), text_.size());
    const std::size_t behind = std::min(end + closing.size(), text_.size());
    while (at_ < behind) advance();
    return slice(begin, end);
  }
  void skip_comment() {
    at_ += 2;
    if (const auto signs = long_bracket()) {
      long_text(*signs);
      return;
    }
    while (!ended() && text_[at_] != '\n') ++at_;
  }
  std::string_view quoted() {
    const char quote = text_[at_];
    advance();
    const std::size_t begin = at_;
    while (!ended() && text_[at_] != quote) {
      if (text_[at_] == '\\' && at_ + 1 < text_.size()) advance();
      advance();
    }
    const std::size_t end = at_;
    if (!ended()) advance();
    return slice(begin, end);
  }

  Token next() {
    while (!ended()) {
      if (std::isspace(static_cast<unsigned char>(text_[at_])))
        advance();
      else if (text_[at_] == '-' && at(at_ + 1) == '-')
        skip_comment();
      else if (text_[at_] == '#' && at_ == 0)  // the first line of a program
        while (!ended() && text_[at_] != '\n') ++at_;
      else
        break;
    }
    Token token{.line = line_};
    if (ended()) return token;
    const auto word = [](char c) {
      return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
    };
    const char c = text_[at_];
    if (c == '"' || c == '\'') return {Token::Kind::kText, quoted(), token.line};
    if (const auto signs = long_bracket())
      return {Token::Kind::kText, long_text(*signs), token.line};
    const std::size_t begin = at_;
    if (std::isdigit(static_cast<unsigned char>(c)) ||
        (c == '.' && std::isdigit(static_cast<unsigned char>(at(at_ + 1))))) {
      while (word(at(at_)) || at(at_) == '.' ||
             ((at(at_) == '+' || at(at_) == '-') &&
              std::string_view("eEpP").find(at(at_ - 1)) != std::string_view::npos))
        ++at_;
      return {Token::Kind::kNumber, slice(begin, at_), token.line};
    }
    if (word(c)) {
      while (word(at(at_))) ++at_;
      token.text = slice(begin, at_);
      const bool reserved = std::ranges::find(kLuaKeywords, token.text) != std::end(kLuaKeywords);
      token.kind = reserved ? Token::Kind::kKeyword : Token::Kind::kName;
      return token;
    }
    for (const std::string_view symbol :
         {"...", "..", "==", "~=", "<=", ">=", "<<", ">>", "//", "::"})
      if (text_.compare(at_, symbol.size(), symbol) == 0) {
        at_ += symbol.size();
        return {Token::Kind::kSymbol, symbol, token.line};
      }
    ++at_;
    return {Token::Kind::kSymbol, slice(at_ - 1, at_), token.line};
  }

  const std::string& text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

struct Argument {
  std::string name, unit;
  Dimension dimension;
};

// "of the sphere, m", "rad/s, about its axis": the one part that is a unit.
std::optional<Argument> argument(std::string_view name, std::string_view doc) {
  std::optional<Argument> found;
  for (std::size_t begin = 0; begin <= doc.size();) {
    const std::size_t end = std::min(doc.find_first_of(",;", begin), doc.size());
    std::string_view part = doc.substr(begin, end - begin);
    begin = end + 1;
    part.remove_prefix(std::min(part.find_first_not_of(' '), part.size()));
    part = part.substr(0, part.find_last_not_of(' ') + 1);
    const std::optional<Dimension> dimension = dimension_of(part);
    if (!dimension) continue;
    if (found) return {};
    found = Argument{std::string(name), std::string(part), *dimension};
  }
  return found;
}

class UnitCheck {
 public:
  UnitCheck(const std::string& text, const std::string& file, Registry& registry)
      : tokens_(Lexer(text).tokens()), file_(file), registry_(registry) {}

  void run() {
    count_meanings();
    for (std::size_t i = 0; i + 1 < tokens_.size(); ++i) {
      if (tokens_[i].is("local")) bind_locals(i + 1);
      check_constructor(i);
    }
  }

 private:
  using Kind = Token::Kind;
  const Token& token(std::size_t i) const { return tokens_[std::min(i, tokens_.size() - 1)]; }
  bool is_name(std::size_t i, std::string_view name) const {
    return token(i).kind == Kind::kName && token(i).text == name;
  }
  // Behind the bracket that token i opens.
  std::size_t behind(std::size_t i) const {
    int depth = 0;
    for (; i < tokens_.size(); ++i) {
      const Token& each = tokens_[i];
      if (each.is("(") || each.is("{") || each.is("[")) ++depth;
      if ((each.is(")") || each.is("}") || each.is("]")) && --depth == 0) return i + 1;
    }
    return i;
  }

  void count_meanings();
  void bind_locals(std::size_t i);
  void check_constructor(std::size_t i) const;
  void check_field(std::size_t kind, std::size_t key) const;
  std::optional<Argument> given(std::size_t key) const;
  const PluginInfo* plugin_at(std::size_t i) const;
  std::optional<Argument> declaration(std::size_t i, std::size_t& end) const;
  bool ends_expression(std::size_t i) const;

  std::vector<Token> tokens_;
  const std::string& file_;
  Registry& registry_;
  std::map<std::string_view, int> meanings_;  // how often a name is declared or assigned
  std::map<std::string_view, Argument> arguments_;
};

// Names of locals, of parameters of functions and of loops; and assignments that are no keys of a
// table.
void UnitCheck::count_meanings() {
  std::vector<char> open;    // brackets, and f for blocks that `end` closes
  std::size_t declared = 0;  // up to here names were counted
  for (std::size_t i = 0; i < tokens_.size(); ++i) {
    const Token& each = tokens_[i];
    const auto declare = [&](std::size_t at) {
      for (; token(at).kind == Kind::kName; ++at) {
        ++meanings_[token(at).text];
        ++at;
        if (token(at).is("<")) at += 3;  // an attribute
        if (!token(at).is(",")) break;
      }
      declared = at;
    };
    if (each.is("local") || each.is("for")) declare(i + 1);
    if (each.is("function")) {
      std::size_t at = i + 1;
      if (token(at).kind == Kind::kName && token(at + 1).is("(")) ++meanings_[token(at).text];
      while (!token(at).is("(") && token(at).kind != Kind::kEnd) ++at;
      declare(at + 1);
    }
    if (each.is("function") || each.is("do") || each.is("if")) open.push_back('f');
    if (each.is("(") || each.is("{") || each.is("[")) open.push_back(each.text[0]);
    const bool closes = each.is("end") || each.is(")") || each.is("}") || each.is("]");
    if (closes && !open.empty()) open.pop_back();
    const bool key = !open.empty() && open.back() == '{';
    const bool member = i > 0 && (tokens_[i - 1].is(".") || tokens_[i - 1].is(":"));
    const bool list = open.empty() || open.back() == 'f';
    if (each.kind == Kind::kName && i >= declared && !member && !key &&
        (token(i + 1).is("=") || (list && token(i + 1).is(","))))
      ++meanings_[each.text];
  }
}

// `sim.arg("k", 50, "N/m")` at token i, and the token behind it.
std::optional<Argument> UnitCheck::declaration(std::size_t i, std::size_t& end) const {
  if (!(is_name(i, "sim") && token(i + 1).is(".") && is_name(i + 2, "arg") && token(i + 3).is("(")))
    return {};
  end = behind(i + 3);
  const Token &name = token(i + 4), &doc = token(end - 2);
  if (name.kind != Kind::kText || doc.kind != Kind::kText || !token(end - 3).is(",") ||
      end - 2 <= i + 6)
    return {};
  return argument(name.text, doc.text);
}

// After a call, what begins another statement ends the expression.
bool UnitCheck::ends_expression(std::size_t i) const {
  static const std::set<std::string_view> goes_on = {"and", "or", "(", "{", "[", ".", ":"};
  const Token& each = token(i);
  if (each.kind == Kind::kName || each.kind == Kind::kEnd) return true;
  if (each.kind == Kind::kKeyword) return !goes_on.contains(each.text);
  return each.is(",") || each.is(";") || each.is("}") || each.is("::");
}

// `local a, b = sim.arg(..), sim.arg(..)`, as far as arguments stand first.
void UnitCheck::bind_locals(std::size_t i) {
  std::vector<std::string_view> names;
  for (; token(i).kind == Kind::kName; ++i) {
    names.push_back(token(i).text);
    ++i;
    if (token(i).is("<")) i += 3;
    if (!token(i).is(",")) break;
  }
  if (!token(i).is("=")) return;
  for (const std::string_view name : names) {
    std::size_t end = 0;
    const std::optional<Argument> found = declaration(i + 1, end);
    if (end == 0 || !ends_expression(end)) return;
    if (found && meanings_[name] == 1) arguments_[name] = *found;
    if (!token(end).is(",")) return;
    i = end;
  }
}

// sim.KIND.NAME { KEY = .. }, also in round brackets.
void UnitCheck::check_constructor(std::size_t i) const {
  if (!(is_name(i, "sim") && token(i + 1).is(".") && token(i + 3).is(".") &&
        token(i + 4).kind == Kind::kName))
    return;
  std::size_t at = i + 5;
  if (token(at).is("(")) ++at;
  if (!token(at).is("{")) return;
  const std::size_t last = behind(at);
  for (++at; at + 1 < last; ++at) {
    if (token(at).kind == Kind::kName && token(at + 1).is("=")) check_field(i + 2, at);
    while (at < last && !token(at).is(",") && !token(at).is(";"))
      at = token(at).is("(") || token(at).is("{") || token(at).is("[") ? behind(at) : at + 1;
  }
}

// The argument that the field is given as it is.
std::optional<Argument> UnitCheck::given(std::size_t key) const {
  std::size_t end = key + 3;
  std::optional<Argument> found;
  if (const auto known = arguments_.find(token(key + 2).text);
      token(key + 2).kind == Kind::kName && known != arguments_.end())
    found = known->second;
  else
    found = declaration(key + 2, end);
  const bool whole = token(end).is(",") || token(end).is(";") || token(end).is("}");
  return whole ? found : std::nullopt;
}

// The plugin of sim.KIND.NAME, KIND being token i. One that cannot be opened is told of where it is
// used.
const PluginInfo* UnitCheck::plugin_at(std::size_t i) const {
  for (const PluginKind& kind : kPluginKinds)
    if (kind.name == token(i).text) try {
        return registry_.find(kind, std::string(token(i + 2).text));
      } catch (const Error&) {
        return nullptr;
      }
  return nullptr;
}

void UnitCheck::check_field(std::size_t kind, std::size_t key) const {
  const std::optional<Argument> argument = given(key);
  if (!argument) return;
  const PluginInfo* const plugin = plugin_at(kind);
  if (!plugin) return;
  const auto param = std::ranges::find(plugin->params, token(key).text, &Param::name);
  if (param == plugin->params.end()) return;
  const std::optional<Dimension> wanted = dimension_of(param->unit);
  if (!wanted || argument->dimension == *wanted) return;
  const std::string maker =
      "sim." + std::string(token(kind).text) + "." + std::string(token(kind + 2).text);
  throw Error(ErrorKind::kScene,
              {"wrong unit", file_ + ":" + std::to_string(token(key).line),
               "'" + param->name + "' of " + maker + " is in " + param->unit + ", argument '" +
                   argument->name + "' in " + argument->unit,
               "give it an argument in " + param->unit + ", or correct what sim.arg says of '" +
                   argument->name + "'"});
}

}  // namespace

void check_argument_units(const std::string& text, const std::string& file, Registry& registry) {
  if (text.find("sim.arg") != std::string::npos) UnitCheck(text, file, registry).run();
}

}  // namespace sim
