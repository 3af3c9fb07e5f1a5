#include "core/expression/parse.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/base/utf8.h"

namespace sim {
namespace {

constexpr std::size_t kLongest = 10000;  // characters
constexpr int kDeepest = 200;            // parentheses, signs, powers and definitions

struct Function {
  std::string_view name;
  Op op;
};
constexpr Function kFunctions[] = {
    {"sqrt", Op::kSqrt}, {"exp", Op::kExp},  {"log", Op::kLog},       {"sin", Op::kSin},
    {"cos", Op::kCos},   {"tan", Op::kTan},  {"sinh", Op::kSinh},     {"cosh", Op::kCosh},
    {"tanh", Op::kTanh}, {"abs", Op::kAbs},  {"sign", Op::kSign},     {"step", Op::kStep},
    {"min", Op::kMin},   {"max", Op::kMax},  {"select", Op::kSelect}, {"floor", Op::kFloor},
    {"pow", Op::kPower}, {"if", Op::kSelect}};

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

class Parser {
 public:
  Parser(std::string_view text, const std::string& what, Names& names, Graph& graph)
      : text_(text), what_(what), names_(names), graph_(graph) {}

  int formula() {
    if (text_.size() > kLongest) {
      at_ = kLongest;
      fail("it has more than " + std::to_string(kLongest) + " characters");
    }
    find_definitions();
    const int result = comparison();
    if (!ended()) unexpected();
    for (const auto& [name, definition] : definitions_)
      if (definition.node < 0) {
        at_ = definition.name_at;
        fail("'" + name + "' is defined but not used");
      }
    return result;
  }

 private:
  struct Definition {
    std::size_t name_at, text_at;
    int node = -1;
    bool open = false;  // being read
  };

  [[noreturn]] void fail(const std::string& why, const std::string& remedy = {}) const {
    // The text around the place, on one line.
    constexpr std::size_t kAround = 30;
    const std::size_t begin = at_ > kAround ? utf8_head(text_, at_ - kAround).size() : 0;
    std::string part(utf8_head(text_.substr(begin), 2 * kAround));
    std::ranges::replace_if(part, is_space, ' ');
    part = visible_line(part);
    if (begin > 0) part = "..." + part;
    if (begin + 2 * kAround < text_.size()) part += "...";
    throw Error(
        ErrorKind::kScene,
        {what_, "", "column " + std::to_string(at_ + 1) + " of '" + part + "': " + why, remedy});
  }

  [[noreturn]] void unexpected() {
    skip_space();
    const char c = peek();
    if (ended()) fail("it ends where a number, a name or '(' is expected");
    const bool begins = is_digit(c) || is_letter(c) || c == '(' || c == '.';
    const std::string remedy = begins ? "write * between factors"
                               : c == '<' || c == '>' || c == '='
                                   ? "compare two sums: a < b, a <= b, a > b or a >= b"
                               : text_.substr(at_, 2) == "**" ? "write ^ for powers"
                                                              : "";
    const bool plain = static_cast<unsigned char>(c) > 0x20 && static_cast<unsigned char>(c) < 0x7f;
    fail(plain ? std::string("unexpected '") + c + "'" : "unexpected character", remedy);
  }

  // The end of the text or of this definition.
  bool ended() {
    skip_space();
    return at_ >= text_.size() || text_[at_] == ';';
  }
  char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  void skip_space() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
  }
  bool take(char c) {
    skip_space();
    if (peek() != c) return false;
    ++at_;
    return true;
  }
  bool take_at_once(char c) {
    if (peek() != c) return false;
    ++at_;
    return true;
  }
  std::string name() {
    const std::size_t begin = at_;
    while (is_letter(peek()) || is_digit(peek())) ++at_;
    return std::string(text_.substr(begin, at_ - begin));
  }

  // Each `; NAME = ...` behind the formula.
  void find_definitions() {
    while ((at_ = text_.find(';', at_)) != std::string_view::npos) {
      ++at_;
      if (skip_space(), at_ >= text_.size()) break;  // a last semicolon
      const std::size_t name_at = at_;
      const std::string defined = is_letter(peek()) ? name() : "";
      if (defined.empty() || !take('=')) fail("expected NAME = FORMULA behind a semicolon");
      const bool taken = names_.numbers.contains(defined) || defined == "pi" ||
                         std::ranges::count(names_.inputs, defined);
      if (taken || !definitions_.try_emplace(defined, Definition{name_at, at_}).second) {
        at_ = name_at;
        fail("'" + defined + "' has a meaning already", "choose another name");
      }
    }
    at_ = 0;
  }

  struct Deeper {
    explicit Deeper(Parser& parser) : depth(parser.depth_) {
      if (++depth > kDeepest)
        parser.fail("it is nested deeper than " + std::to_string(kDeepest) + " levels");
    }
    ~Deeper() { --depth; }
    int& depth;
  };

  // 1 where it is true, else 0: a >= b is step(a - b).
  int comparison() {
    int left = sum();
    const bool less = take('<');
    if (!less && !take('>')) return left;
    const bool or_equal = take_at_once('=');
    int right = sum();
    if (less == or_equal) std::swap(left, right);
    const int step = graph_.make(Op::kStep, graph_.make(Op::kSubtract, left, right));
    return or_equal ? step : graph_.make(Op::kSubtract, graph_.number(1), step);
  }

  int sum() {
    const Deeper deeper(*this);
    int result = product();
    for (;;) {
      if (take('+'))
        result = graph_.make(Op::kAdd, result, product());
      else if (take('-'))
        result = graph_.make(Op::kSubtract, result, product());
      else
        return result;
    }
  }

  int product() {
    int result = factor();
    for (;;) {
      if (take('*'))
        result = graph_.make(Op::kMultiply, result, factor());
      else if (take('/'))
        result = graph_.make(Op::kDivide, result, factor());
      else
        return result;
    }
  }

  // -x^2 is -(x^2); x^-2 and x^y^z = x^(y^z) are legal.
  int factor() {
    const Deeper deeper(*this);
    if (take('-')) return graph_.make(Op::kNegate, factor());
    if (take('+')) return factor();
    const int base = primary();
    return take('^') ? graph_.make(Op::kPower, base, factor()) : base;
  }

  int primary() {
    skip_space();
    if (is_digit(peek()) || peek() == '.') return number();
    if (is_letter(peek())) return named();
    if (ended() || !take('(')) unexpected();
    const int result = comparison();
    close();
    return result;
  }

  void close() {
    if (take(')')) return;
    if (ended()) fail("a ')' is missing");
    unexpected();
  }

  int number() {
    double value = 0;
    const auto [end, error] =
        std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error == std::errc::result_out_of_range) fail("the number is too large or too small");
    if (error != std::errc()) unexpected();
    at_ = static_cast<std::size_t>(end - text_.data());
    return graph_.number(value);
  }

  int named() {
    const std::size_t begin = at_;
    const std::string word = name();
    if (take('(')) return call(word, begin);
    if (const auto input = std::ranges::find(names_.inputs, word); input != names_.inputs.end()) {
      names_.used.insert(word);
      const int index = static_cast<int>(input - names_.inputs.begin());
      return index < names_.cells.count && take('[') ? neighbour(word, index) : graph_.input(index);
    }
    if (const auto number = names_.numbers.find(word); number != names_.numbers.end()) {
      names_.used.insert(word);
      return graph_.number(number->second);
    }
    if (const auto found = definitions_.find(word); found != definitions_.end())
      return defined(word, found->second, begin);
    if (word == "pi") return graph_.number(std::numbers::pi);

    at_ = begin;
    for (const Function& function : kFunctions)
      if (function.name == word) fail("the function '" + word + "' needs its arguments in ( )");
    std::vector<std::string> known = names_.inputs;
    for (const auto& entry : names_.numbers) known.push_back(entry.first);
    for (const auto& entry : definitions_) known.push_back(entry.first);
    known.push_back("pi");
    const std::string near = nearest(word, known);
    fail("'" + word + "' is not known",
         near.empty() ? "give " + word + " = NUMBER, or use one of: " + join(known, ", ")
                      : "did you mean '" + near + "'? else give " + word + " = NUMBER");
  }

  // Behind NAME[.
  int neighbour(const std::string& word, int index) {
    CellNames& cells = names_.cells;
    if (cells.directions == 0)
      fail("'" + word + "' has no neighbours: there is one cell", "give cells = N");
    Neighbour other{index, {}};
    for (int k = 0; k < cells.directions; ++k) {
      if (k > 0 && !take(',')) wrong_index(word);
      other.offset[static_cast<std::size_t>(k)] =
          whole_number(word, cells.extents[static_cast<std::size_t>(k)]);
    }
    if (!take(']')) wrong_index(word);
    if (other.offset == std::array<int, 3>{}) return graph_.input(index);
    const auto known = std::ranges::find(cells.neighbours, other);
    const auto number = known - cells.neighbours.begin();
    if (known == cells.neighbours.end()) cells.neighbours.push_back(other);
    return graph_.input(static_cast<int>(names_.inputs.size()) + static_cast<int>(number));
  }

  [[noreturn]] void wrong_index(const std::string& word) {
    constexpr const char* kForms[] = {"[-1]", "[0, -1]", "[0, 0, -1]"};
    skip_space();
    fail("a neighbour of '" + word + "' in " + std::to_string(names_.cells.directions) +
             (names_.cells.directions == 1 ? " direction" : " directions") + " is expected",
         "write it as " + word + kForms[names_.cells.directions - 1]);
  }

  // Less than `extent` in either direction.
  int whole_number(const std::string& word, int extent) {
    skip_space();
    const std::size_t begin = at_;
    const bool minus = take('-');
    if (!minus) take('+');
    skip_space();
    int value = 0;
    const auto [end, error] =
        std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    const bool far = error == std::errc::result_out_of_range || value >= extent;
    if (error == std::errc::invalid_argument || !is_digit(peek())) wrong_index(word);
    if (far) {
      at_ = begin;
      fail("the lattice has " + std::to_string(extent) + " cells in this direction",
           "name a neighbour that is less far away");
    }
    at_ = static_cast<std::size_t>(end - text_.data());
    return minus ? -value : value;
  }

  int defined(const std::string& word, Definition& definition, std::size_t begin) {
    if (definition.node >= 0) return definition.node;
    const std::size_t back = at_;
    if (definition.open) {
      at_ = begin;
      fail("the definition of '" + word + "' leads back to itself");
    }
    definition.open = true;
    at_ = definition.text_at;
    definition.node = comparison();
    if (!ended()) unexpected();
    at_ = back;
    return definition.node;
  }

  int call(const std::string& word, std::size_t begin) {
    const auto function =
        std::ranges::find_if(kFunctions, [&](const Function& f) { return f.name == word; });
    if (function == std::end(kFunctions)) {
      at_ = begin;
      std::vector<std::string> known;
      for (const Function& each : kFunctions) known.emplace_back(each.name);
      fail("there is no function '" + word + "'", suggestion(word, known));
    }
    const int wanted = operand_count(function->op);
    int operands[] = {-1, -1, -1}, given = 0;
    do {
      if (given < wanted) operands[given] = comparison();
    } while (given++ < wanted && take(','));
    if (given != wanted) {
      at_ = begin;
      fail("'" + word + "' takes " + std::to_string(wanted) +
           (wanted == 1 ? " argument" : " arguments"));
    }
    close();
    return graph_.make(function->op, operands[0], operands[1], operands[2]);
  }

  std::string_view text_;
  const std::string& what_;
  Names& names_;
  Graph& graph_;
  std::size_t at_ = 0;
  int depth_ = 0;
  std::map<std::string, Definition> definitions_;
};

}  // namespace

int parse(std::string_view text, const std::string& what, Names& names, Graph& graph) {
  const int root = Parser(text, what, names, graph).formula();
  const std::vector<bool> used = graph.used_by({&root, 1});
  for (std::size_t id = 0; id < used.size(); ++id)
    if (used[id] && graph.constant(static_cast<int>(id)) &&
        !std::isfinite(graph[static_cast<int>(id)].number))
      throw Error(ErrorKind::kScene, {what, "", "a part of it is a constant that is not finite",
                                      "look for a division by 0, or a root or logarithm of a "
                                      "negative number"});
  return root;
}

}  // namespace sim
