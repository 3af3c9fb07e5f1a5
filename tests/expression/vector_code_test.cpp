// Loops of machine code over arrays against the interpreter, bit by bit.
#include "core/expression/vector_code.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <random>

#include "core/expression/x86_code.h"
#include "core/simd/simd_targets.h"

using namespace sim;

namespace {

using Operand = VectorCode::Operand;

constexpr int kOps = static_cast<int>(Op::kDifferenceTimes) + 1;
constexpr int kMost = 300, kMargin = 16;  // elements of an array, and around them

// Arrays that are only read come first; each other one has one slot, at distance 0.
struct Case {
  std::vector<Instruction> code;
  std::vector<Operand> slots;
  int arrays = 0, read = 0;
};

Case random_case(std::mt19937& random, int arrays, int values, int count, bool functions) {
  Case made;
  made.arrays = arrays;
  made.read = (arrays + 1) / 2;
  const auto below = [&](int most) {
    return static_cast<int>(random() % static_cast<unsigned>(most));
  };
  std::vector<std::uint16_t> known, written;  // slots
  const auto add = [&](Operand slot) {
    made.slots.push_back(slot);
    return static_cast<std::uint16_t>(made.slots.size() - 1);
  };
  for (int i = 0; i < 3 * made.read; ++i)
    known.push_back(add({Operand::Kind::kArray, i % made.read, below(2 * kMargin) - kMargin}));
  for (int i = 0; i < 3; ++i)
    known.push_back(add({Operand::Kind::kUniform, 0, 0, 0.1 * below(40) - 2}));
  for (int i = 0; i < values; ++i) written.push_back(add({}));
  for (int i = made.read; i < arrays; ++i) {
    written.push_back(add({Operand::Kind::kArray, i}));
    known.push_back(written.back());  // what it held before
  }
  for (int i = 0; i < count; ++i) {
    const auto op = static_cast<Op>((i + below(3)) % kOps);
    if (op == Op::kNumber || op == Op::kInput) continue;
#ifdef SIM_WRITES_CODE
    if (!functions && x86::recipe(op).form == x86::Recipe::kCall) continue;
#endif
    const auto any = [&] {
      return known[static_cast<std::size_t>(below(static_cast<int>(known.size())))];
    };
    const std::uint16_t to =
        written[static_cast<std::size_t>(below(static_cast<int>(written.size())))];
    made.code.push_back({op, to, {any(), any(), any()}});
    known.push_back(to);
  }
  return made;
}

// The arrays of a case, with numbers from -2 to 2, some of them special.
class Arrays {
 public:
  explicit Arrays(int count) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> number(-2, 2);
    for (int i = 0; i < count; ++i) {
      std::vector<double>& array = numbers_.emplace_back(kMost + 2 * kMargin);
      for (double& each : array) each = number(random);
      array[20] = std::nan("");
      array[22] = -0.0;
      array[23] = 0;
      array[24] = INFINITY;
    }
    for (std::vector<double>& array : numbers_) pointers_.push_back(array.data() + kMargin);
  }
  double* const* data() { return pointers_.data(); }
  double at(int array, int element) const {
    return pointers_[static_cast<std::size_t>(array)][element];
  }

 private:
  std::vector<std::vector<double>> numbers_;
  std::vector<double*> pointers_;
};

bool same(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b));
}

bool writes_loops() {
#ifdef SIM_WRITES_CODE
  return for_simd_level(false, false, true, true);
#else
  return false;
#endif
}

}  // namespace

TEST_CASE("loops of machine code have the bits of the interpreter") {
  std::mt19937 random(11);
  // Few values stay in registers, many do not; few arrays leave registers to the caller.
  for (const int arrays : {2, 6, 9, 13})
    for (const int values : {1, 5, 14, 40})
      for (int turn = 0; turn < 12; ++turn) {
        const Case made = random_case(random, arrays, values, 4 + 12 * turn, false);
        VectorCode fast(made.code, made.slots);
        VectorCode plain(made.code, made.slots, VectorCode::Form::kInterpreted);
        CHECK_FALSE(plain.is_native());
        CHECK(fast.is_native() == (writes_loops() && !made.code.empty()));
        Arrays a(arrays), b(arrays);
        const int count = turn % 3 == 0 ? 1 + turn : 8 * turn + 5;
        for (int run = 0; run < 2; ++run) {
          fast.run(a.data(), count);
          plain.run(b.data(), count);
        }
        for (int array = 0; array < arrays; ++array)
          for (int i = 0; i < count; ++i)
            if (!same(a.at(array, i), b.at(array, i))) {
              FAIL_CHECK(arrays << " arrays, " << values << " values, turn " << turn << ": element "
                                << i << " of array " << array << " is " << a.at(array, i)
                                << ", not " << b.at(array, i));
              break;
            }
        // Beyond the next multiple of 8 nothing is written.
        const int end = (count + 7) / 8 * 8;
        Arrays before(arrays);
        for (int array = 0; array < arrays; ++array) {
          CHECK(same(a.at(array, end), before.at(array, end)));
          CHECK(same(a.at(array, -1), before.at(array, -1)));
        }
      }
}

TEST_CASE("elementary functions and many arrays are interpreted, in blocks") {
  const auto slots = [](int arrays) {
    std::vector<Operand> made;
    for (int i = 0; i < arrays; ++i) made.push_back({Operand::Kind::kArray, i});
    return made;
  };
  VectorCode sine({{Op::kSin, 1, {0, 0, 0}}}, slots(2));
  CHECK_FALSE(sine.is_native());
  Arrays arrays(2);
  sine.run(arrays.data(), 290);
  for (const int i : {0, 1, 127, 128, 129, 289})
    CHECK(same(arrays.at(1, i), evaluate(Op::kSin, arrays.at(0, i))));
  std::vector<Instruction> sum;
  for (std::uint16_t i = 1; i < 14; ++i) sum.push_back({Op::kAdd, 0, {0, i, 0}});
  CHECK_FALSE(VectorCode(sum, slots(14)).is_native());
  sum.pop_back();
  CHECK(VectorCode(sum, slots(13)).is_native() == writes_loops());
}

TEST_CASE("a number that changes is read by the next run, and code moves") {
  const std::vector<Operand> slots = {
      {Operand::Kind::kArray, 0}, {Operand::Kind::kArray, 1}, {Operand::Kind::kUniform, 0, 0, 2}};
  for (const auto form : {VectorCode::Form::kFastest, VectorCode::Form::kInterpreted}) {
    VectorCode made({{Op::kMultiply, 1, {0, 2, 0}}}, slots, form);
    VectorCode code;
    Arrays arrays(2);
    code.run(arrays.data(), 0);
    code = std::move(made);
    code.run(arrays.data(), 3);
    CHECK(arrays.at(1, 2) == 2 * arrays.at(0, 2));
    code.set_uniform(2, -3);
    code.run(arrays.data(), 3);
    CHECK(arrays.at(1, 2) == -3 * arrays.at(0, 2));
  }
}
