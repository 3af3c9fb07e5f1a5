// A strict reader of JSON (RFC 8259) that keeps what tests ask for.
#pragma once

#include <cstdlib>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace sim_test {

struct Json {
  enum class Kind { kNull, kFlag, kNumber, kText, kList, kObject } kind = Kind::kNull;
  bool flag = false;
  double number = 0;
  std::string text;
  std::vector<Json> list;
  std::vector<std::string> keys;  // in their order
  std::map<std::string, Json> members;

  const Json& at(const std::string& key) const { return members.at(key); }
  bool has(const std::string& key) const { return members.count(key) == 1; }
};

// The entry of a list whose member "name" is that; throws std::runtime_error where there is none.
inline const Json& named(const Json& list, const std::string& name) {
  for (const Json& each : list.list)
    if (each.at("name").text == name) return each;
  throw std::runtime_error("nothing is called " + name);
}

// Throws std::runtime_error for anything that is not one JSON value, for a key given twice, and for
// a number that is not finite.
class JsonReader {
 public:
  explicit JsonReader(const std::string& text) : text_(text) {}

  Json read() {
    Json value = read_value();
    skip_space();
    if (at_ != text_.size()) fail("text behind the value");
    return value;
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw std::runtime_error("JSON: " + why + " at " + std::to_string(at_) + " in " + text_);
  }
  char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  void skip_space() {
    while (peek() == ' ' || peek() == '\n' || peek() == '\t' || peek() == '\r') ++at_;
  }
  bool take(char c) {
    skip_space();
    if (peek() != c || at_ == text_.size()) return false;
    ++at_;
    return true;
  }
  void expect(char c) {
    if (!take(c)) fail(std::string("no ") + c);
  }
  bool take_word(const std::string& word) {
    if (text_.compare(at_, word.size(), word) != 0) return false;
    at_ += word.size();
    return true;
  }

  Json read_value() {
    skip_space();
    Json value;
    if (peek() == '{') return read_object();
    if (peek() == '[') return read_list();
    if (peek() == '"') {
      value.kind = Json::Kind::kText;
      value.text = read_string();
    } else if (take_word("true") || take_word("false")) {
      value.kind = Json::Kind::kFlag;
      value.flag = text_.compare(at_ - 4, 4, "true") == 0;
    } else if (!take_word("null")) {
      value.kind = Json::Kind::kNumber;
      value.number = read_number();
    }
    return value;
  }

  Json read_object() {
    Json value;
    value.kind = Json::Kind::kObject;
    expect('{');
    if (take('}')) return value;
    do {
      skip_space();
      const std::string key = read_string();
      expect(':');
      if (!value.members.emplace(key, read_value()).second) fail("key " + key + " twice");
      value.keys.push_back(key);
    } while (take(','));
    expect('}');
    return value;
  }

  Json read_list() {
    Json value;
    value.kind = Json::Kind::kList;
    expect('[');
    if (take(']')) return value;
    do {
      value.list.push_back(read_value());
    } while (take(','));
    expect(']');
    return value;
  }

  std::string read_string() {
    if (peek() != '"') fail("no string");
    std::string out;
    for (++at_; peek() != '"'; ++at_) {
      if (at_ >= text_.size() || static_cast<unsigned char>(peek()) < 0x20) fail("bad string");
      if (peek() != '\\') {
        out += peek();
        continue;
      }
      ++at_;
      if (peek() == 'u') {
        const std::string digits = text_.substr(at_ + 1, 4);
        if (digits.size() != 4 ||
            digits.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos)
          fail("bad \\u");
        out += static_cast<char>(std::strtol(digits.c_str(), nullptr, 16));
        at_ += 4;
      } else if (std::string("\"\\/bfnrt").find(peek()) != std::string::npos) {
        out += peek();
      } else {
        fail("bad escape");
      }
    }
    ++at_;
    return out;
  }

  void digits() {
    const std::size_t begin = at_;
    while (peek() >= '0' && peek() <= '9') ++at_;
    if (at_ == begin) fail("no digit");
  }

  double read_number() {
    const std::size_t begin = at_;
    if (peek() == '-') ++at_;
    if (peek() == '0') {
      ++at_;
    } else {
      digits();
    }
    if (peek() == '.') {
      ++at_;
      digits();
    }
    if (peek() == 'e' || peek() == 'E') {
      ++at_;
      if (peek() == '+' || peek() == '-') ++at_;
      digits();
    }
    const double value = std::strtod(text_.substr(begin, at_ - begin).c_str(), nullptr);
    if (value - value != 0) fail("number out of range");
    return value;
  }

  std::string text_;
  std::size_t at_ = 0;
};

inline Json read_json(const std::string& text) { return JsonReader(text).read(); }

}  // namespace sim_test
