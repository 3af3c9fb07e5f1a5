#include "core/expression/straight_code.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#if defined(__x86_64__) && defined(__linux__)
#define SIM_WRITES_CODE 1
#include <sys/mman.h>
#endif

namespace sim {

#ifdef SIM_WRITES_CODE
namespace {

using Bytes = std::vector<unsigned char>;

// Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2: F2 0F op is an operation
// of doubles on the low half of a register xmm0 .. xmm15.
enum Scalar : unsigned char {
  kLoad = 0x10,
  kStore = 0x11,
  kSqrtsd = 0x51,
  kAddsd = 0x58,
  kMulsd = 0x59,
  kSubsd = 0x5c,
  kDivsd = 0x5e
};
constexpr std::size_t kSignMask = 0, kSizeMask = 16, kEntry = 32;  // places in the code

// Writes code for `void f(double* slots)`. Registers are evicted by least recent use. A value is
// written to its slot only if something reads it there.
class Assembler {
 public:
  Assembler(std::span<const Instruction> code, const std::function<bool(int)>& live)
      : code_(code), writer_(slots_of(code), -1) {
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
    for (now_ = 0; now_ < code_.size(); ++now_) {
      const Instruction& instruction = code_[now_];
      if (!arithmetic(instruction)) call(instruction);
      writer_[instruction.to] = static_cast<int>(now_);
    }
    for (std::size_t slot = 0; slot < writer_.size(); ++slot)
      if (live(static_cast<int>(slot))) is_read(static_cast<int>(slot));
    add({0x5b, 0xc3});  // pop rbx; ret
  }

  // False for what is no operation of the processor.
  bool arithmetic(const Instruction& now) {
    const auto [a, b, c] = now.operand;
    switch (now.op) {
      case Op::kCopy:
        result(now.to, a, {});
        return true;
      case Op::kNegate:
        result(now.to, a, {});
        masked(0x57, kSignMask);
        return true;
      case Op::kAbs:
        result(now.to, a, {});
        masked(0x54, kSizeMask);
        return true;
      case Op::kSqrt: {
        const int from = in_register(a), to = room({from});
        scalar(kSqrtsd, to, from);
        finish(to, now.to);
        return true;
      }
      case Op::kAdd:
        result(now.to, a, {{kAddsd, b}});
        return true;
      case Op::kSubtract:
        result(now.to, a, {{kSubsd, b}});
        return true;
      case Op::kMultiply:
        result(now.to, a, {{kMulsd, b}});
        return true;
      case Op::kDivide:
        result(now.to, a, {{kDivsd, b}});
        return true;
      case Op::kProductPlus:
        result(now.to, a, {{kMulsd, b}, {kAddsd, c}});
        return true;
      case Op::kProductMinus:
        result(now.to, a, {{kMulsd, b}, {kSubsd, c}});
        return true;
      case Op::kSumPlus:
        result(now.to, a, {{kAddsd, b}, {kAddsd, c}});
        return true;
      case Op::kSumMinus:
        result(now.to, a, {{kAddsd, b}, {kSubsd, c}});
        return true;
      case Op::kDifferencePlus:
        result(now.to, a, {{kSubsd, b}, {kAddsd, c}});
        return true;
      case Op::kDifferenceMinus:
        result(now.to, a, {{kSubsd, b}, {kSubsd, c}});
        return true;
      case Op::kProductTimes:
        result(now.to, a, {{kMulsd, b}, {kMulsd, c}});
        return true;
      case Op::kSumTimes:
        result(now.to, a, {{kAddsd, b}, {kMulsd, c}});
        return true;
      case Op::kDifferenceTimes:
        result(now.to, a, {{kSubsd, b}, {kMulsd, c}});
        return true;
      case Op::kMinusProduct: {
        const int x = in_register(a), y = in_register(b, {x}), z = in_register(c, {x, y});
        const int product = room({x, y, z});
        copy(product, x);
        scalar(kMulsd, product, y);
        const int to = room({z, product});
        copy(to, z);
        scalar(kSubsd, to, product);
        finish(to, now.to);
        return true;
      }
      default:
        return false;
    }
  }

  struct Then {
    Scalar op;
    int slot;
  };
  // slots[to] := (slots[from] op slots[..]) op slots[..]; last_ is the register of the result.
  void result(int to, int from, std::initializer_list<Then> then) {
    const int first = in_register(from);
    std::array<int, 3> busy{first, first, first};
    std::size_t count = 1;
    for (const Then& next : then) {
      busy[count] = in_register(next.slot, busy);
      ++count;
    }
    const int target = room(busy);
    copy(target, first);
    count = 1;
    for (const Then& next : then) scalar(next.op, target, busy[count++]);
    last_ = target;
    pending_ = to;
    // A mask may follow; what is stored is the value behind it.
    const Op op = code_[now_].op;
    if (op != Op::kNegate && op != Op::kAbs) finish(target, to);
  }
  void masked(unsigned char op, std::size_t mask) {
    const std::size_t end = bytes_.size() + (last_ > 7 ? 9 : 8);
    add({0x66});
    if (last_ > 7) add({0x44});
    add({0x0f, op, static_cast<unsigned char>(((last_ & 7) << 3) | 5)});
    add_number(static_cast<std::uint32_t>(mask - end));
    finish(last_, pending_);
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

  void forget() {
    held_.fill(-1);
    used_.fill(0);
  }

  template <class Busy>
  int free_of(const Busy& busy) {
    int best = -1;
    for (int i = 0; i < kRegisters; ++i) {
      if (std::ranges::find(busy, i) != std::end(busy)) continue;
      const auto at = static_cast<std::size_t>(i);
      if (held_[at] < 0) return i;
      if (best < 0 || used_[at] < used_[static_cast<std::size_t>(best)]) best = i;
    }
    return best;
  }
  template <class Busy>
  int room_for(const Busy& busy) {
    const int free = free_of(busy);
    held_[static_cast<std::size_t>(free)] = -1;
    used_[static_cast<std::size_t>(free)] = ++clock_;
    return free;
  }
  int room(std::initializer_list<int> busy) { return room_for(busy); }
  int room(const std::array<int, 3>& busy) { return room_for(busy); }

  int in_register(int slot) { return in_register(slot, std::array<int, 3>{-1, -1, -1}); }
  int in_register(int slot, std::initializer_list<int> busy) {
    std::array<int, 3> all{-1, -1, -1};
    std::ranges::copy(busy, all.begin());
    return in_register(slot, all);
  }
  int in_register(int slot, const std::array<int, 3>& busy) {
    for (int i = 0; i < kRegisters; ++i)
      if (const auto at = static_cast<std::size_t>(i); held_[at] == slot) {
        used_[at] = ++clock_;
        return i;
      }
    const int free = room_for(busy);
    is_read(slot);
    memory(kLoad, free, slot);
    held_[static_cast<std::size_t>(free)] = slot;
    return free;
  }

  void is_read(int slot) {
    const int writer = writer_[static_cast<std::size_t>(slot)];
    if (found_ && writer >= 0) (*found_)[static_cast<std::size_t>(writer)] = true;
  }

  void finish(int from, int slot) {
    for (int& held : held_)
      if (held == slot) held = -1;
    held_[static_cast<std::size_t>(from)] = slot;
    if (read_[now_]) memory(kStore, from, slot);
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
  void scalar(Scalar op, int to, int from) {
    add({0xf2});
    rex(to, from);
    add({0x0f, op, static_cast<unsigned char>(0xc0 | ((to & 7) << 3) | (from & 7))});
  }
  void copy(int to, int from) {  // movapd
    if (to == from) return;
    add({0x66});
    rex(to, from);
    add({0x0f, 0x28, static_cast<unsigned char>(0xc0 | ((to & 7) << 3) | (from & 7))});
  }
  void memory(Scalar op, int value, int slot) {  // at [rbx + 8 slot]
    add({0xf2});
    rex(value, 0);
    add({0x0f, op, static_cast<unsigned char>(0x83 | ((value & 7) << 3))});
    add_number(8 * static_cast<std::uint32_t>(slot));
  }
  void rex(int to, int from) {
    if (to > 7 || from > 7)
      add({static_cast<unsigned char>(0x40 | (to > 7 ? 4 : 0) | (from > 7 ? 1 : 0))});
  }

  std::span<const Instruction> code_;
  std::vector<int> writer_;  // of each slot, the last one so far
  std::vector<bool> read_;   // in memory, the value of each instruction
  std::vector<bool>* found_ = nullptr;
  Bytes bytes_;
  std::size_t now_ = 0;
  int last_ = 0, pending_ = 0, clock_ = 0;
  std::array<int, kRegisters> held_ = {}, used_ = {};
};

}  // namespace
#endif

StraightCode::StraightCode(std::vector<Instruction> code,
                           [[maybe_unused]] const std::function<bool(int)>& live, Form form)
    : code_(std::move(code)) {
#ifdef SIM_WRITES_CODE
  if (form == Form::kInterpreted || code_.empty()) return;
  const Assembler assembler(code_, live);
  const Bytes& bytes = assembler.bytes();
  void* const pages =
      ::mmap(nullptr, bytes.size(), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages == MAP_FAILED) return;
  std::memcpy(pages, bytes.data(), bytes.size());
  if (::mprotect(pages, bytes.size(), PROT_READ | PROT_EXEC) != 0) {
    ::munmap(pages, bytes.size());
    return;
  }
  pages_ = pages;
  bytes_ = bytes.size();
  native_ = reinterpret_cast<void (*)(double*)>(static_cast<unsigned char*>(pages) + kEntry);
#else
  static_cast<void>(form);
#endif
}

StraightCode::~StraightCode() {
#ifdef SIM_WRITES_CODE
  if (pages_) ::munmap(pages_, bytes_);
#endif
}

StraightCode::StraightCode(StraightCode&& other) noexcept
    : code_(std::move(other.code_)),
      native_(std::exchange(other.native_, nullptr)),
      pages_(std::exchange(other.pages_, nullptr)),
      bytes_(std::exchange(other.bytes_, 0)) {}

StraightCode& StraightCode::operator=(StraightCode&& other) noexcept {
  std::swap(code_, other.code_);
  std::swap(native_, other.native_);
  std::swap(pages_, other.pages_);
  std::swap(bytes_, other.bytes_);
  return *this;
}

}  // namespace sim
