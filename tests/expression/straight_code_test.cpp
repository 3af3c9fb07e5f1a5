// Machine code of instructions against the interpreter, bit by bit.
#include "core/expression/straight_code.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <random>

#include "core/expression/program.h"

using namespace sim;

namespace {

constexpr int kOps = static_cast<int>(Op::kDifferenceTimes) + 1;

bool same(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b));
}

// Instructions at random on slots that hold numbers from -2 to 2; every operation comes.
std::vector<Instruction> random_code(std::mt19937& random, int slots, int count) {
  std::uniform_int_distribution<int> slot(0, slots - 1);
  std::vector<Instruction> code;
  for (int i = 0; i < count; ++i) {
    const auto op = static_cast<Op>((i + static_cast<int>(random() % 3)) % kOps);
    if (op == Op::kNumber || op == Op::kInput) continue;
    const auto any = [&] { return static_cast<std::uint16_t>(slot(random)); };
    code.push_back({op, any(), {any(), any(), any()}});
  }
  return code;
}

}  // namespace

TEST_CASE("machine code of instructions has the bits of the interpreter") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-2, 2);
  int native = 0;
  // Few slots stay in registers, many do not.
  for (const int slots : {3, 9, 15, 40, 300})
    for (int turn = 0; turn < 20; ++turn) {
      const std::vector<Instruction> code = random_code(random, slots, 5 + 20 * turn);
      // Every third slot is read behind the run.
      const auto kept = [](int slot) { return slot % 3 == 0; };
      const StraightCode fast(code, kept);
      const StraightCode plain(code, kept, StraightCode::Form::kInterpreted);
      CHECK_FALSE(plain.is_native());
      native += fast.is_native();
      std::vector<double> a(static_cast<std::size_t>(slots)), b;
      for (double& value : a) value = number(random);
      a[0] = turn % 2 ? -0.0 : 0.0;
      b = a;
      for (int run = 0; run < 2; ++run) {
        fast.run(a.data());
        plain.run(b.data());
        // Slots that are not kept may hold anything, and a second run may read it.
        for (int i = 0; i < slots; ++i) {
          const auto at = static_cast<std::size_t>(i);
          if (kept(i) && !same(a[at], b[at]))
            FAIL_CHECK(slots << " slots, turn " << turn << ": slot " << i << " is " << a[at]
                             << ", not " << b[at]);
          if (!kept(i)) a[at] = b[at] = number(random);
        }
      }
    }
#if defined(__x86_64__) && defined(__linux__)
  CHECK(native == 100);
#endif
}

// Neighbours that do the same become one instruction on two numbers; operands in a row, the same
// twice, one of a pair alone, slots that overlap, and results that the next pair reads.
TEST_CASE("machine code of instructions in pairs has the bits of the interpreter") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-2, 2);
  for (const int slots : {4, 7, 16, 60, 400})
    for (int turn = 0; turn < 60; ++turn) {
      std::uniform_int_distribution<int> slot(0, slots - 2);
      std::vector<Instruction> code;
      for (int i = 0; i < 10 + 5 * turn; ++i) {
        const auto op = static_cast<Op>(random() % kOps);
        if (op == Op::kNumber || op == Op::kInput) continue;
        const auto any = [&] { return static_cast<std::uint16_t>(slot(random)); };
        Instruction now{op, any(), {any(), any(), any()}};
        if (random() % 3 == 0) now.operand[2] = now.to;  // a sum that grows
        const auto row = random() % 4;
        for (unsigned j = 0; j <= row && now.to < slots; ++j) {
          code.push_back(now);
          ++now.to;
          for (std::uint16_t& operand : now.operand)
            if (random() % 3 && operand + 1 < slots) ++operand;
        }
      }
      const auto all = [](int) { return true; };
      const StraightCode fast(
          code, turn % 2 ? all : [](int at) { return at % 3 == 0; });
      const StraightCode plain(code, all, StraightCode::Form::kInterpreted);
      std::vector<double> a(static_cast<std::size_t>(slots)), b;
      for (double& value : a) value = number(random);
      if (turn % 5 == 0) a[0] = std::nan("");
      if (turn % 7 == 0) a[1] = -0.0;
      b = a;
      fast.run(a.data());
      plain.run(b.data());
      for (int i = 0; i < slots; i += turn % 2 ? 1 : 3) {
        const auto at = static_cast<std::size_t>(i);
        if (!same(a[at], b[at]))
          FAIL_CHECK(slots << " slots, turn " << turn << ": slot " << i << " is " << a[at]
                           << ", not " << b[at]);
      }
    }
}

TEST_CASE("code that moves to another place still runs, and no code does nothing") {
  StraightCode first({{Op::kSin, 1, {0, 0, 0}}}, [](int) { return true; });
  StraightCode second = std::move(first);
  StraightCode third;
  double slots[] = {0.5, 0};
  third.run(slots);
  CHECK(slots[1] == 0);
  third = std::move(second);
  third.run(slots);
  CHECK(same(slots[1], evaluate(Op::kSin, 0.5)));
}
