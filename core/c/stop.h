// The question whether a call is to end, for what it calls.
#pragma once

#include <functional>
#include <utility>

namespace sim::c {

class Stop {
 public:
  bool asked() const { return question_ && question_(); }

  // While it exists the question is this one.
  class By {
   public:
    By(Stop& stop, std::function<bool()> question) : stop_(stop) {
      stop_.question_ = std::move(question);
    }
    ~By() { stop_.question_ = {}; }
    By(const By&) = delete;
    By& operator=(const By&) = delete;

   private:
    Stop& stop_;
  };

 private:
  std::function<bool()> question_;
};

}  // namespace sim::c
