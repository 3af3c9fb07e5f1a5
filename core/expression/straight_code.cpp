#include "core/expression/straight_code.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "core/expression/x86_code.h"

namespace sim {

#ifdef SIM_WRITES_CODE
namespace {

using x86::Opcode, x86::Recipe;
using Bytes = std::vector<unsigned char>;

// F2 0F op is an operation on the low half of a register xmm0 .. xmm15, 66 0F op one on both
// halves.
constexpr unsigned char kLow = 0xf2, kBoth = 0x66;                 // prefixes
constexpr std::size_t kSignMask = 0, kSizeMask = 16, kEntry = 32;  // places in the code

// Writes code for `void f(double* slots)`. Registers are evicted by least recent use. A value is
// written to its slot only if something reads it there. Two instructions in a row that do the same
// to neighbouring slots become one on both halves of a register.
class Assembler {
 public:
  Assembler(std::span<const Instruction> code, const std::function<bool(int)>& live)
      : code_(code), writer_(slots_of(code), -1), uses_(writer_.size()) {
    for (std::size_t i = 0; i < code.size(); ++i) {
      for (int j = 0; j < operand_count(code[i].op); ++j)
        uses_[code[i].operand[j]].push_back({static_cast<int>(i), false});
      uses_[code[i].to].push_back({static_cast<int>(i), true});
    }
    // Whose values are read in memory is known once the code has been written without knowing it.
    read_.assign(code.size(), true);
    std::vector<bool> read(code.size(), false);
    found_ = &read;
    write(live);
    read_ = read;
    found_ = nullptr;
    write(live);
  }
  const Bytes& bytes() const { return bytes_; }

 private:
  static constexpr int kRegisters = 16;

  static std::size_t slots_of(std::span<const Instruction> code) {
    std::size_t most = 0;
    for (const Instruction& now : code) {
      most = std::max<std::size_t>(most, now.to);
      for (int i = 0; i < operand_count(now.op); ++i)
        most = std::max<std::size_t>(most, now.operand[i]);
    }
    return most + 1;
  }

  void write(const std::function<bool(int)>& live) {
    bytes_.clear();
    forget();
    std::ranges::fill(writer_, -1);
    const std::uint64_t sign = std::uint64_t{1} << 63, masks[] = {sign, sign, ~sign, ~sign};
    bytes_.resize(sizeof masks);
    std::memcpy(bytes_.data(), masks, sizeof masks);
    add({0x53});              // push rbx
    add({0x48, 0x89, 0xfb});  // mov rbx, rdi
    for (now_ = 0; now_ < code_.size(); now_ += wide_ ? 2 : 1) {
      wide_ = is_pair();
      if (const int result = arithmetic(); result >= 0)
        finish(result);
      else
        call(code_[now_]);
      for (std::size_t i = now_; i < now_ + (wide_ ? 2 : 1); ++i)
        writer_[code_[i].to] = static_cast<int>(i);
    }
    for (std::size_t slot = 0; slot < writer_.size(); ++slot)
      if (live(static_cast<int>(slot))) is_read(static_cast<int>(slot));
    add({0x5b, 0xc3});  // pop rbx; ret
  }

  // True if the next two instructions can be one.
  bool is_pair() const {
    if (now_ + 1 >= code_.size()) return false;
    const Instruction &first = code_[now_], &second = code_[now_ + 1];
    if (second.op != first.op || second.to != first.to + 1 ||
        x86::recipe(first.op).form == Recipe::kCall)
      return false;
    bool differ = false;
    for (int i = 0; i < operand_count(first.op); ++i) {
      const int a = first.operand[i], b = second.operand[i];
      if ((b != a && b != a + 1) || b == first.to) return false;
      differ = differ || b != a;
    }
    return differ;
  }

  // The register of the result; -1: no operation of the processor.
  int arithmetic() {
    const Recipe made = x86::recipe(code_[now_].op);
    switch (made.form) {
      case Recipe::kChain:
        return chained(made);
      case Recipe::kMasked:
        return masked(chained({}), made.first, made.first == x86::kXor ? kSignMask : kSizeMask);
      case Recipe::kSquareRoot: {
        const int from = operand(0), to = room({from});
        operate(x86::kRoot, to, from);
        return to;
      }
      case Recipe::kExtreme:
        return extreme(made.first);
      case Recipe::kProductPlus:
        return product_plus();
      case Recipe::kMinusProduct:
        return minus_product();
      default:
        return -1;
    }
  }

  // (operand 0 op operand 1) op operand 2, in the register that is returned.
  int chained(const Recipe& made) {
    std::array<int, 3> from;
    from.fill(operand(0));
    for (int i = 1; i <= made.count; ++i) from[static_cast<std::size_t>(i)] = operand(i, from);
    const bool symmetric = made.count > 0 && x86::is_symmetric(made.first);
    const int last = made.count > 1 ? from[2] : -1;
    if (symmetric && !is_free(from[0], last) && is_free(from[1], last)) std::swap(from[0], from[1]);
    const int to = own(from[0], last, from);
    if (made.count > 0) operate(made.first, to, from[1]);
    if (made.count > 1) operate(made.second, to, from[2]);
    return to;
  }

  // A sum that grows stays in its register.
  int product_plus() {
    const auto [x, y, sum, product] = product_of_operands();
    const bool grows = code_[now_].operand[2] == code_[now_].to || is_free(sum, product);
    const int to = grows ? sum : product;
    operate(x86::kSum, to, grows ? product : sum);
    return to;
  }
  int minus_product() {
    const auto [x, y, from, product] = product_of_operands();
    const int to = own(from, product, std::array{from, product});
    operate(x86::kDifference, to, product);
    return to;
  }

  struct ProductPlus {
    int x, y, z, product;
  };
  ProductPlus product_of_operands() {
    int x = operand(0), y = operand(1, {x});
    const int z = operand(2, {x, y});
    if (!is_free(y, z)) std::swap(x, y);
    const int product = own(y, z, std::array{x, y, z});
    operate(x86::kProduct, product, x);
    return {x, y, z, product};
  }

  // `op` of b and a is a where they are equal or a is not a number, and where b is not: a mask of
  // ones, which is no number either.
  int extreme(Opcode op) {
    const int a = operand(0), b = operand(1, {a}), unordered = room({a, b});
    copy(unordered, b);
    prefixed(wide_ ? kBoth : kLow, x86::kCompare, unordered, unordered);  // cmpunord
    add({3});
    const int to = own(b, -1, std::array{a, b, unordered});
    operate(op, to, a);
    prefixed(kBoth, x86::kOr, to, unordered);
    return to;
  }

  // A register with the value of `from`, to be changed: itself if nothing reads it later.
  template <class Busy>
  int own(int from, int read, const Busy& busy) {
    if (is_free(from, read)) return from;
    const int to = room(busy);
    copy(to, from);
    return to;
  }
  // True if nothing reads the register behind the present instruction, nor is it `read` by it.
  bool is_free(int i, int read) {
    const Register& each = at(i);
    if (i == read) return false;
    if (each.content == Content::kPair) return is_dead(each.slot) && is_dead(each.slot + 1);
    return is_dead(each.slot);
  }
  // True if the value of the slot is not read behind the present instruction.
  bool is_dead(int slot) const {
    const int last = static_cast<int>(now_) + (wide_ ? 1 : 0);
    if (slot >= code_[now_].to && slot <= code_[now_].to + (wide_ ? 1 : 0)) return true;
    const std::vector<Use>& uses = uses_[static_cast<std::size_t>(slot)];
    const auto next = std::ranges::upper_bound(uses, last, {}, &Use::at);
    return next == uses.end() || next->writes;
  }

  int masked(int to, Opcode op, std::size_t mask) {
    const std::size_t end = bytes_.size() + (to > 7 ? 9 : 8);
    add({kBoth});
    if (to > 7) add({0x44});
    add({0x0f, op, static_cast<unsigned char>(((to & 7) << 3) | 5)});
    add_number(static_cast<std::uint32_t>(mask - end));
    return to;
  }

  void call(const Instruction& now) {
    for (int i = 0; i < operand_count(now.op); ++i) is_read(now.operand[i]);
    forget();
    add({0x48, 0xbf});  // mov rdi, the instruction
    add_pointer(&code_[now_]);
    add({0xbe, 1, 0, 0, 0});  // mov esi, 1: together a span
    add({0x48, 0x89, 0xda});  // mov rdx, rbx
    add({0x48, 0xb8});        // mov rax, run_straight()
    const RunStraight run = run_straight();
    const void* address = nullptr;
    static_assert(sizeof address == sizeof run);
    std::memcpy(&address, &run, sizeof run);
    add_pointer(address);
    add({0xff, 0xd0});  // call rax
    if (found_) (*found_)[now_] = true;
  }

  // --- Registers ---

  enum class Content { kOne, kPair, kTwice };  // a slot, it and the next one, a slot in both halves
  struct Register {
    int slot = -1, used = 0;
    Content content = Content::kOne;
  };

  void forget() { registers_.fill({}); }

  Register& at(int i) { return registers_[static_cast<std::size_t>(i)]; }

  template <class Busy = std::array<int, 0>>
  int room(const Busy& busy = {}) {
    int best = -1;
    for (int i = 0; i < kRegisters; ++i) {
      if (std::ranges::find(busy, i) != std::end(busy)) continue;
      if (at(i).slot < 0) {
        best = i;
        break;
      }
      if (best < 0 || at(i).used < at(best).used) best = i;
    }
    at(best) = {.used = ++clock_};
    return best;
  }
  int room(std::initializer_list<int> busy) { return room<std::initializer_list<int>>(busy); }

  int found(int slot, Content content) {
    for (int i = 0; i < kRegisters; ++i)
      if (at(i).slot == slot && at(i).content == content) {
        at(i).used = ++clock_;
        return i;
      }
    return -1;
  }
  // A register whose low half is the slot.
  int found_low(int slot) {
    for (const Content content : {Content::kOne, Content::kTwice, Content::kPair})
      if (const int i = found(slot, content); i >= 0) return i;
    return -1;
  }

  // The register of operand i of the present instruction, or of two.
  template <class Busy = std::array<int, 0>>
  int operand(int i, const Busy& busy = {}) {
    const int slot = code_[now_].operand[i];
    if (!wide_) return one(slot, busy);
    return code_[now_ + 1].operand[i] == slot ? twice(slot, busy) : pair(slot, busy);
  }
  int operand(int i, std::initializer_list<int> busy) {
    return operand<std::initializer_list<int>>(i, busy);
  }

  template <class Busy>
  int one(int slot, const Busy& busy) {
    if (const int i = found_low(slot); i >= 0) return i;
    const int high = found(slot - 1, Content::kPair);
    const int to = room(with(busy, high));
    if (high >= 0) {
      copy(to, high);
      prefixed(kBoth, x86::kUnpackHigh, to, to);
    } else {
      load(kLow, x86::kLoad, to, slot);
    }
    return holds(to, slot, Content::kOne);
  }

  template <class Busy>
  int twice(int slot, const Busy& busy) {
    if (const int i = found(slot, Content::kTwice); i >= 0) return i;
    const int low = found_low(slot);
    const int to = room(with(busy, low));
    if (low >= 0)
      copy(to, low);
    else
      load(kLow, x86::kLoad, to, slot);
    prefixed(kBoth, x86::kUnpackLow, to, to);
    return holds(to, slot, Content::kTwice);
  }

  template <class Busy>
  int pair(int slot, const Busy& busy) {
    if (const int i = found(slot, Content::kPair); i >= 0) return i;
    const int low = found_low(slot), high = found_low(slot + 1);
    const int to = room(with(busy, low, high));
    if (low >= 0 && high >= 0) {
      copy(to, low);
      prefixed(kBoth, x86::kUnpackLow, to, high);
    } else if (is_fresh(slot) || is_fresh(slot + 1)) {
      load(kLow, x86::kLoad, to, slot);
      load(kBoth, x86::kLoadHigh, to, slot + 1);
    } else {
      load(kBoth, x86::kLoad, to, slot);
      is_read(slot + 1);
    }
    return holds(to, slot, Content::kPair);
  }

  // A number that was written alone a moment ago: a load of it with its neighbour would wait until
  // it has left the store buffer.
  bool is_fresh(int slot) const {
    constexpr int kMoment = 40;
    const int writer = writer_[static_cast<std::size_t>(slot)];
    return writer >= 0 && static_cast<int>(now_) - writer < kMoment;
  }

  template <class Busy>
  static std::array<int, 5> with(const Busy& busy, int one, int another = -1) {
    std::array<int, 5> all;
    all.fill(one);
    std::ranges::copy(busy, all.begin());
    all.back() = another;
    return all;
  }

  int holds(int i, int slot, Content content) {
    at(i).slot = slot;
    at(i).content = content;
    return i;
  }

  void is_read(int slot) {
    const int writer = writer_[static_cast<std::size_t>(slot)];
    if (found_ && writer >= 0) (*found_)[static_cast<std::size_t>(writer)] = true;
  }

  // The register `from` has the result of the present instruction, or of two.
  void finish(int from) {
    const int slot = code_[now_].to, last = slot + (wide_ ? 1 : 0);
    for (Register& each : registers_) {
      const int end = each.slot + (each.content == Content::kPair ? 1 : 0);
      if (each.slot < 0 || end < slot || each.slot > last) continue;
      if (each.slot < slot)
        each.content = Content::kOne;  // of a pair the low half is left
      else
        each = {};
    }
    at(from).used = ++clock_;
    holds(from, slot, wide_ ? Content::kPair : Content::kOne);
    if (read_[now_] || (wide_ && read_[now_ + 1]))
      memory(wide_ ? kBoth : kLow, x86::kStore, from, slot);
  }

  // --- Bytes ---

  void add(std::initializer_list<unsigned char> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void add_number(std::uint32_t number) {
    for (int i = 0; i < 4; ++i) add({static_cast<unsigned char>(number >> (8 * i))});
  }
  void add_pointer(const void* pointer) {
    const auto number = reinterpret_cast<std::uintptr_t>(pointer);
    add_number(static_cast<std::uint32_t>(number));
    add_number(static_cast<std::uint32_t>(number >> 32));
  }
  void operate(Opcode op, int to, int from) { prefixed(wide_ ? kBoth : kLow, op, to, from); }
  void prefixed(unsigned char prefix, int op, int to, int from) {
    add({prefix});
    rex(to, from);
    add({0x0f, static_cast<unsigned char>(op),
         static_cast<unsigned char>(0xc0 | ((to & 7) << 3) | (from & 7))});
  }
  void copy(int to, int from) {
    if (to != from) prefixed(kBoth, x86::kMove, to, from);
  }
  void load(unsigned char prefix, Opcode op, int to, int slot) {
    is_read(slot);
    memory(prefix, op, to, slot);
  }
  void memory(unsigned char prefix, Opcode op, int value, int slot) {  // at [rbx + 8 slot]
    add({prefix});
    rex(value, 0);
    add({0x0f, op, static_cast<unsigned char>(0x83 | ((value & 7) << 3))});
    add_number(8 * static_cast<std::uint32_t>(slot));
  }
  void rex(int to, int from) {
    if (to > 7 || from > 7)
      add({static_cast<unsigned char>(0x40 | (to > 7 ? 4 : 0) | (from > 7 ? 1 : 0))});
  }

  std::span<const Instruction> code_;
  struct Use {
    int at;  // an instruction that reads the slot first and then writes it
    bool writes;
  };
  std::vector<int> writer_;             // of each slot, the last one so far
  std::vector<std::vector<Use>> uses_;  // of each slot, in order
  std::vector<bool> read_;              // in memory, the value of each instruction
  std::vector<bool>* found_ = nullptr;
  Bytes bytes_;
  std::size_t now_ = 0;
  bool wide_ = false;  // the present instruction and the next one are one
  int clock_ = 0;
  std::array<Register, kRegisters> registers_ = {};
};

}  // namespace
#endif

StraightCode::StraightCode(std::vector<Instruction> code,
                           [[maybe_unused]] const std::function<bool(int)>& live, Form form)
    : code_(std::move(code)) {
#ifdef SIM_WRITES_CODE
  if (form == Form::kInterpreted || code_.empty()) return;
  const Assembler assembler(code_, live);
  pages_ = x86::CodePages(assembler.bytes());
  native_ = pages_.entry<void(double*)>(kEntry);
#else
  static_cast<void>(form);
#endif
}

}  // namespace sim
