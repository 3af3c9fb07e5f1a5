#include "core/expression/vector_code.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>
#include <utility>

#include "core/base/assert.h"
#include "core/simd/simd_targets.h"

namespace sim {
namespace {

constexpr int kLanes = 8, kLanesOfAvx2 = 4;  // of a register
constexpr int kMostBlock = 128;              // elements that are interpreted at a time
constexpr std::ptrdiff_t kScratch = 8192;    // numbers of interpreted registers, on the stack
constexpr std::size_t kMasks = 2;            // numbers behind those of the operands: sign, and size

using Kind = VectorCode::Operand::Kind;

}  // namespace

#ifdef SIM_WRITES_CODE
namespace {

using x86::Opcode, x86::Recipe;

// Writes code for `void f(double* const* arrays, const double* numbers, ptrdiff_t bytes)`: a loop
// over elements, four at a time with AVX2 and eight with AVX-512, whose bytes in an array are a
// multiple of 64. Instructions name their result apart from their operands, the last of which may
// lie in memory.
//
// The numbers that are read most stay in registers throughout the loop, as many as make its
// accesses to memory the fewest. A value that has no register left is written to memory; the one
// whose next use is furthest away goes first (Belady 1966).
class LoopAssembler {
 public:
  LoopAssembler(std::span<const Instruction> code, std::span<const VectorCode::Operand> slots,
                std::size_t stride, int lanes)
      : code_(code),
        operands_(slots),
        stride_(stride),
        lanes_(lanes),
        registers_(lanes == kLanes ? 32 : 16),
        in_memory_(slots.size()),
        uses_(slots.size()),
        spill_(slots.size()) {
    for (std::size_t i = 0; i < code.size(); ++i) {
      for (int j = 0; j < operand_count(code[i].op); ++j) use(code[i].operand[j], i, false);
      use(code[i].to, i, true);
    }
    if (arrays_ > kMostArrays) return;
    for (std::size_t i = 0; i < slots.size(); ++i)
      if (slots[i].kind == Kind::kUniform && uses_[i].size() > 0)
        numbers_.push_back(static_cast<int>(i));
    std::ranges::stable_sort(numbers_, std::ranges::greater{},
                             [&](int slot) { return uses_[index(slot)].size(); });
    int best = 0, fewest = kNever;
    const int most = static_cast<int>(std::min(registers_.size() - kLeast, numbers_.size()));
    for (kept_ = 0; kept_ <= most; ++kept_) {
      write();
      if (accesses_ < fewest) {
        fewest = accesses_;
        best = kept_;
      }
    }
    kept_ = best;
    write();
  }

  // Code for more arrays than there are registers for their addresses is not written.
  static constexpr std::size_t kMostArrays = 13;

  // None: no such code.
  const std::vector<unsigned char>& bytes() const { return bytes_; }

 private:
  // General registers: addresses of arrays, callers' own ones among them, the last one that of the
  // list of arrays; then numbers and the bytes that are left, counted from below 0.
  static constexpr std::array<unsigned char, kMostArrays> kAddress = {0, 1,  8,  9,  10, 11, 3,
                                                                      5, 12, 13, 14, 15, 7};
  static constexpr std::size_t kFirstSaved = 6, kLastSaved = 11;
  static constexpr unsigned char kUniforms = 6, kIndex = 2, kArrays = 7;

  // Registers of numbers throughout the loop leave room for an instruction.
  static constexpr std::size_t kLeast = 4;
  static constexpr int kNone = -1, kNever = std::numeric_limits<int>::max();

  struct Use {
    int at;  // an instruction that reads the slot first and then writes it
    bool writes;
  };
  // A register, or memory where it is none.
  struct Source {
    int slot = kNone, reg = kNone;
  };

  void use(int slot, std::size_t at, bool writes) {
    uses_[index(slot)].push_back({static_cast<int>(at), writes});
    const VectorCode::Operand& each = operands_[index(slot)];
    if (each.kind != Kind::kArray) return;
    const auto array = index(each.array);
    if (array >= address_.size()) address_.resize(array + 1, kNone);
    if (address_[array] == kNone) address_[array] = static_cast<int>(arrays_++);
  }

  void write() {
    bytes_.clear();
    std::ranges::fill(registers_, kNone);
    for (std::size_t i = 0; i < operands_.size(); ++i)
      in_memory_[i] = operands_[i].kind != Kind::kRegister;
    spills_ = 0;
    const std::size_t saved =
        arrays_ <= kFirstSaved ? kFirstSaved : std::min(arrays_, kLastSaved + 1);
    for (std::size_t i = kFirstSaved; i < saved; ++i) push(kAddress[i], 0x50);
    add({0x48, 0x81, 0xec});  // sub rsp
    const std::size_t room = bytes_.size();
    add_number(0);
    // The register of the list is the last that gets an address.
    for (std::size_t number = 0; number < arrays_; ++number) {
      const auto array = static_cast<std::uint32_t>(
          std::ranges::find(address_, static_cast<int>(number)) - address_.begin());
      general(0x8b, kAddress[number], kArrays, 8 * array);  // mov
      general(0x03, kAddress[number], kIndex);              // add
    }
    add({0x48, 0xf7, 0xda});  // neg rdx
    for (int reg = 0; reg < kept_; ++reg) {
      registers_[index(reg)] = numbers_[index(reg)];
      memory(x86::kLoad, reg, 0, numbers_[index(reg)]);
    }
    accesses_ = 0;
    const std::size_t loop = bytes_.size();
    for (now_ = 0; now_ < code_.size(); ++now_) arithmetic();
    add({0x48, 0x83, 0xc2, static_cast<unsigned char>(width()), 0x0f, 0x85});  // add rdx; jnz
    add_number(static_cast<std::uint32_t>(loop - bytes_.size() - 4));
    add({0xc5, 0xf8, 0x77});  // vzeroupper
    add({0x48, 0x81, 0xc4});  // add rsp
    add_number(width() * spills_);
    std::copy_n(bytes_.end() - 4, 4, bytes_.begin() + static_cast<std::ptrdiff_t>(room));
    for (std::size_t i = saved; i-- > kFirstSaved;) push(kAddress[i], 0x58);
    add({0xc3});
  }

  void arithmetic() {
    const Instruction& now = code_[now_];
    const Recipe made = x86::recipe(now.op);
    switch (made.form) {
      case Recipe::kChain:
        return chained(made);
      case Recipe::kMasked: {
        // The masks are the last numbers.
        const Source from = in_register(now.operand[0], {});
        const int mask = static_cast<int>(operands_.size()) + (made.first == x86::kXor ? 0 : 1);
        const int to = room({}, {from.reg});
        operate(made.first, to, from.reg, {mask, kNone});
        return finish(to);
      }
      case Recipe::kSquareRoot: {
        const Source from = operand(now.operand[0], {});
        const int to = room({}, {from.reg});
        operate(x86::kRoot, to, 0, from);
        return finish(to);
      }
      case Recipe::kExtreme:
        return extreme(made.first);
      case Recipe::kProductPlus:
        return product_and(x86::kSum);
      case Recipe::kMinusProduct:
        return product_and(x86::kDifference);
      default:
        SIM_ASSERT(false);
    }
  }

  void chained(const Recipe& made) {
    const Instruction& now = code_[now_];
    if (made.count == 0) return finish(copied(in_register(now.operand[0], {}).reg));
    auto [first, second] = operands(made.first, now.operand[0], now.operand[1]);
    Source third;
    if (made.count > 1) third = operand(now.operand[2], {first.reg, second.reg});
    const int to = room({third.reg}, {first.reg, second.reg});
    operate(made.first, to, first.reg, second);
    if (made.count > 1) operate(made.second, to, to, third);
    finish(to);
  }

  // z + x y or z - x y.
  void product_and(Opcode op) {
    const Instruction& now = code_[now_];
    const auto [x, y] = operands(x86::kProduct, now.operand[0], now.operand[1]);
    const bool difference = op == x86::kDifference;
    const std::array<int, 2> busy = {x.reg, y.reg};
    const Source z = difference ? in_register(now.operand[2], busy) : operand(now.operand[2], busy);
    const int to = room({z.reg}, busy);
    operate(x86::kProduct, to, x.reg, y);
    if (difference)
      operate(op, to, z.reg, {kNone, to});
    else
      operate(op, to, to, z);
    finish(to);
  }

  // `op` of b and a is a where they are equal or a is not a number, and where b is not: a mask of
  // ones, which is no number either.
  void extreme(Opcode op) {
    const Instruction& now = code_[now_];
    const Source a = operand(now.operand[0], {});
    const Source b = in_register(now.operand[1], std::array{a.reg});
    if (lanes_ == kLanes) {
      const int to = room({a.reg, b.reg}, {});
      operate(x86::kCompare, 1, b.reg, b);  // to the mask k1
      add({3});                             // either is no number
      operate(op, to, b.reg, a);
      set_where_k1(to);
      return finish(to);
    }
    const int unordered = room({a.reg, b.reg}, {});
    operate(x86::kCompare, unordered, b.reg, b);
    add({3});
    const int to = room({a.reg, b.reg, unordered}, {});
    operate(op, to, b.reg, a);
    operate(x86::kOr, to, to, {kNone, unordered});
    registers_[index(unordered)] = kNone;
    finish(to);
  }

  // --- Registers ---

  // Both operands of `op`, the first of them in a register.
  std::pair<Source, Source> operands(Opcode op, int first, int second) {
    if (x86::is_symmetric(op) && found(first) == kNone && found(second) != kNone)
      std::swap(first, second);
    const Source a = in_register(first, {});
    return {a, operand(second, std::array{a.reg})};
  }

  // A register if the slot has one or is read again, else memory.
  Source operand(int slot, std::span<const int> busy) {
    const bool once = operands_[index(slot)].kind == Kind::kUniform || next_use(slot) == kNever;
    if (found(slot) == kNone && in_memory_[index(slot)] && once) return {slot, kNone};
    return in_register(slot, busy);
  }
  Source operand(int slot, std::initializer_list<int> busy) {
    return operand(slot, std::span(busy.begin(), busy.size()));
  }

  Source in_register(int slot, std::span<const int> busy) {
    int reg = found(slot);
    if (reg == kNone) {
      reg = emptied(busy);
      memory(x86::kLoad, reg, 0, slot);
      registers_[index(reg)] = slot;
    }
    return {slot, reg};
  }

  int found(int slot) const {
    const auto at = std::ranges::find(registers_, slot);
    return at == registers_.end() ? kNone : static_cast<int>(at - registers_.begin());
  }

  // The next instruction that reads the slot behind the present one.
  int next_use(int slot) const {
    const std::vector<Use>& uses = uses_[index(slot)];
    const auto next = std::ranges::upper_bound(uses, static_cast<int>(now_), {}, &Use::at);
    return next == uses.end() || next->writes ? kNever : next->at;
  }
  bool is_dead(int slot) const { return slot == code_[now_].to || next_use(slot) == kNever; }

  // A register for the result, none of `kept`: one of `read` if nothing reads it later.
  int room(std::initializer_list<int> kept, std::span<const int> read) {
    const auto is_kept = [&](int reg) { return std::ranges::find(kept, reg) != kept.end(); };
    for (const int reg : read)
      if (reg >= kept_ && !is_kept(reg) && is_dead(registers_[index(reg)])) return reg;
    std::array<int, 8> busy;
    busy.fill(kNone);
    std::ranges::copy(read, std::ranges::copy(kept, busy.begin()).out);
    return emptied(busy);
  }
  int room(std::initializer_list<int> kept, std::initializer_list<int> read = {}) {
    return room(kept, std::span(read.begin(), read.size()));
  }

  // A register without a value, none of `busy`.
  int emptied(std::span<const int> busy) {
    int best = kNone, furthest = -1;
    for (int reg = kept_; reg < std::ssize(registers_); ++reg) {
      if (std::ranges::find(busy, reg) != busy.end()) continue;
      const int slot = registers_[index(reg)];
      if (slot == kNone) return reg;
      const int next = is_read_now(slot) ? static_cast<int>(now_) : next_use(slot);
      if (next > furthest) {
        best = reg;
        furthest = next;
      }
    }
    const int slot = registers_[index(best)];
    if (furthest != kNever && !in_memory_[index(slot)]) {
      spill_[index(slot)] = spills_++;
      memory(x86::kStore, best, 0, slot);
      in_memory_[index(slot)] = true;
    }
    registers_[index(best)] = kNone;
    return best;
  }
  bool is_read_now(int slot) const {
    const Instruction& now = code_[now_];
    return std::find(now.operand, now.operand + operand_count(now.op), slot) !=
           now.operand + operand_count(now.op);
  }

  int copied(int from) {
    const int to = room({}, {from});
    if (to != from) operate(x86::kMove, to, 0, {kNone, from});
    return to;
  }

  // The register has the result of the present instruction.
  void finish(int reg) {
    const int slot = code_[now_].to;
    std::ranges::replace(registers_, slot, kNone);
    registers_[index(reg)] = slot;
    in_memory_[index(slot)] = operands_[index(slot)].kind == Kind::kArray;
    if (in_memory_[index(slot)]) memory(x86::kStore, reg, 0, slot);
  }

  // --- Bytes ---

  std::uint32_t width() const { return static_cast<std::uint32_t>(8 * lanes_); }  // bytes
  static std::size_t index(int number) { return static_cast<std::size_t>(number); }
  void add(std::initializer_list<unsigned char> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void add_number(std::uint32_t number) {
    for (int i = 0; i < 4; ++i) add({static_cast<unsigned char>(number >> (8 * i))});
  }
  void push(unsigned char reg, unsigned char opcode) {
    if (reg > 7) add({0x41});
    add({static_cast<unsigned char>(opcode | (reg & 7))});
  }
  // A general register with another one, or with memory behind it.
  void general(unsigned char opcode, unsigned char to, unsigned char from) {
    add({rex(to, from), opcode, static_cast<unsigned char>(0xc0 | (to & 7) << 3 | (from & 7))});
  }
  void general(unsigned char opcode, unsigned char to, unsigned char base, std::uint32_t distance) {
    add({rex(to, base), opcode, static_cast<unsigned char>(0x80 | (to & 7) << 3 | (base & 7))});
    add_number(distance);
  }
  static unsigned char rex(unsigned char to, unsigned char from) {
    return static_cast<unsigned char>(0x48 | (to > 7 ? 4 : 0) | (from > 7 ? 1 : 0));
  }

  // to := first op second; instructions of one operand have no `first`.
  void operate(Opcode op, int to, int first, const Source& second) {
    if (second.reg == kNone) return memory(op, to, first, second.slot);
    prefix(to, first, second.reg, second.reg > 15);
    add({op, static_cast<unsigned char>(0xc0 | (to & 7) << 3 | (second.reg & 7))});
  }
  void memory(Opcode op, int value, int first, int slot) {
    ++accesses_;
    const auto low = static_cast<unsigned char>(0x80 | (value & 7) << 3);
    const auto at = index(slot);
    if (at >= operands_.size() || operands_[at].kind == Kind::kUniform) {
      prefix(value, first, 0);
      add({op, static_cast<unsigned char>(low | kUniforms)});
      add_number(static_cast<std::uint32_t>(8 * stride_ * at));
    } else if (operands_[at].kind == Kind::kRegister) {
      prefix(value, first, 0);
      add({op, static_cast<unsigned char>(low | 4), 0x24});  // rsp
      add_number(width() * spill_[at]);
    } else {
      const unsigned char base = kAddress[index(address_[index(operands_[at].array)])];
      prefix(value, first, base);
      add({op, static_cast<unsigned char>(low | 4),
           static_cast<unsigned char>(kIndex << 3 | (base & 7))});
      add_number(static_cast<std::uint32_t>(8 * operands_[at].distance));
    }
  }
  // VEX.256.66.0F, or EVEX.512.66.0F.W1, which names registers from 16 on by bits of its own.
  void prefix(int to, int first, int from, bool high = false) {
    const int bits = (to & 8 ? 0 : 0x80) | (high ? 0 : 0x40) | (from & 8 ? 0 : 0x20);
    const int last = (~first & 15) << 3;
    if (lanes_ == kLanes)
      add_bytes(0x62, bits | (to & 16 ? 0 : 0x10) | 1, 0x80 | last | 4 | 1,
                0x40 | (first & 16 ? 0 : 8));
    else
      add_bytes(0xc4, bits | 1, last | 4 | 1);
  }
  // All bits of the elements whose bit in k1 is set: vpternlogq, EVEX.512.66.0F3A.W1.
  void set_where_k1(int reg) {
    prefix(reg, reg, reg, reg > 15);
    bytes_[bytes_.size() - 3] |= 2;
    bytes_.back() |= 1;
    add_bytes(0x25, 0xc0 | (reg & 7) << 3 | (reg & 7), 0xff);
  }
  template <class... Byte>
  void add_bytes(Byte... each) {
    add({static_cast<unsigned char>(each)...});
  }

  std::span<const Instruction> code_;
  std::span<const VectorCode::Operand> operands_;
  std::size_t stride_;
  int lanes_;                           // of a register
  std::vector<int> registers_;          // slots
  std::vector<int> address_;            // of each array, a number of kAddress
  std::size_t arrays_ = 0;              // that have addresses
  std::vector<bool> in_memory_;         // the value of each slot
  std::vector<std::vector<Use>> uses_;  // of each slot, in order
  std::vector<std::uint32_t> spill_;    // of each slot, its place on the stack
  std::uint32_t spills_ = 0;
  std::vector<unsigned char> bytes_;
  std::size_t now_ = 0;
  std::vector<int> numbers_;  // slots, the one read most first
  int kept_ = 0;              // of them have the first registers
  int accesses_ = 0;          // to memory, in the loop
};

// Numbers in a register of this machine; none without AVX2.
int lanes() { return for_simd_level(0, 0, kLanesOfAvx2, kLanes); }

bool may_be_native(std::span<const Instruction> code, std::span<const VectorCode::Operand> slots) {
  constexpr std::ptrdiff_t kFurthest = std::ptrdiff_t{1} << 27;  // bytes fit an instruction
  return std::ranges::none_of(
             code, [](const auto& now) { return x86::recipe(now.op).form == Recipe::kCall; }) &&
         std::ranges::all_of(slots,
                             [](const auto& slot) { return std::abs(slot.distance) < kFurthest; });
}

}  // namespace
#endif

VectorCode::VectorCode(std::vector<Instruction> code, std::vector<Operand> operands,
                       [[maybe_unused]] Form form)
    : code_(std::move(code)), operands_(std::move(operands)), stride_(kLanes) {
  const auto values = std::ranges::count(operands_, Kind::kRegister, &Operand::kind);
  if (operands_.size() > kMostOperands || values > kMostRegisters) refuse_large_code();
#ifdef SIM_WRITES_CODE
  if (form == Form::kFastest && !code_.empty() && lanes() > 0 && may_be_native(code_, operands_)) {
    const LoopAssembler assembler(code_, operands_, stride_, lanes());
    if (!assembler.bytes().empty()) pages_ = x86::CodePages(assembler.bytes());
    native_ = pages_.entry<Native>();
  }
#endif
  if (!native_) {
    const std::ptrdiff_t each = kScratch / std::max<std::ptrdiff_t>(values, 1) / 8 * 8;
    block_ = static_cast<int>(std::min<std::ptrdiff_t>(each, kMostBlock));
    apart_ = each > block_ ? block_ + 8 : block_;  // multiples of 4 KiB would wait for each other
    stride_ = static_cast<std::size_t>(block_);
  }
  numbers_ = Array((operands_.size() + kMasks) * stride_);
  for (std::size_t i = 0; i < operands_.size(); ++i)
    if (operands_[i].kind == Kind::kUniform) set_uniform(static_cast<int>(i), operands_[i].number);
  const std::uint64_t sign = std::uint64_t{1} << 63;
  double* const masks = numbers_.data() + operands_.size() * stride_;
  std::fill_n(masks, stride_, std::bit_cast<double>(sign));
  std::fill_n(masks + stride_, stride_, std::bit_cast<double>(~sign));
}

void VectorCode::set_uniform(int slot, double number) {
  const auto at = static_cast<std::size_t>(slot);
  SIM_ASSERT(operands_[at].kind == Kind::kUniform);
  std::fill_n(numbers_.data() + at * stride_, stride_, number);
}

void VectorCode::run(double* const* arrays, int count) const {
  if (count <= 0) return;
  if (native_)
    native_(arrays, numbers_.data(), std::ptrdiff_t{8} * ((count + kLanes - 1) / kLanes * kLanes));
  else
    interpret(arrays, count);
}

void VectorCode::interpret(double* const* arrays, int count) const {
  alignas(64) double scratch[kScratch];
  double* addresses[kMostOperands];
  double* value = scratch;
  for (std::size_t i = 0; i < operands_.size(); ++i) {
    if (operands_[i].kind == Kind::kUniform) {
      addresses[i] = const_cast<double*>(numbers_.data()) + i * stride_;  // only read
    } else if (operands_[i].kind == Kind::kRegister) {
      addresses[i] = value;
      value += apart_;
    }
  }
  for (int begin = 0; begin < count; begin += block_) {
    for (std::size_t i = 0; i < operands_.size(); ++i)
      if (operands_[i].kind == Kind::kArray)
        addresses[i] = arrays[operands_[i].array] + operands_[i].distance + begin;
    interpret_(code_, addresses, (std::min(block_, count - begin) + 7) / 8 * 8);
  }
}

}  // namespace sim
