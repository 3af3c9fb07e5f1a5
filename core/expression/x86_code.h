// Machine code for x86-64: the operations that instructions are made of, and memory for new code.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/expression/graph.h"

#if defined(__x86_64__) && defined(__linux__)
#define SIM_WRITES_CODE 1
#endif

namespace sim::x86 {

// Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2: the second byte of the
// operations on doubles.
enum Opcode : unsigned char {
  kLoad = 0x10,
  kStore = 0x11,
  kLoadHigh = 0x16,
  kUnpackLow = 0x14,
  kUnpackHigh = 0x15,
  kMove = 0x28,  // from register to register
  kRoot = 0x51,
  kAnd = 0x54,
  kOr = 0x56,
  kXor = 0x57,
  kSum = 0x58,
  kProduct = 0x59,
  kDifference = 0x5c,
  kSmaller = 0x5d,
  kQuotient = 0x5e,
  kLarger = 0x5f,
  kCompare = 0xc2
};

// How an operation is made of the processor's.
struct Recipe {
  enum Form { kCall, kChain, kMasked, kSquareRoot, kExtreme, kProductPlus, kMinusProduct };
  Form form = kCall;  // by none of them
  Opcode first{}, second{};
  int count = 0;  // of the opcodes in a chain: (operand 0 first operand 1) second operand 2
};
Recipe recipe(Op op);

inline bool is_symmetric(Opcode op) { return op == kSum || op == kProduct; }

// Bytes that the system lets run.
class CodePages {
 public:
  CodePages() = default;
  // Memory with these bytes that may be run, not written; none if the system refuses.
  explicit CodePages(std::span<const unsigned char> bytes);
  ~CodePages();
  CodePages(CodePages&& other) noexcept;
  CodePages& operator=(CodePages&& other) noexcept;

  // The address of a byte, as a function; null if there is no code.
  template <class Function>
  Function* entry(std::size_t place = 0) const {
    return pages_ ? reinterpret_cast<Function*>(static_cast<unsigned char*>(pages_) + place)
                  : nullptr;
  }

 private:
  void* pages_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace sim::x86
