#include "core/expression/x86_code.h"

#include <cstring>
#include <utility>

#ifdef SIM_WRITES_CODE
#include <sys/mman.h>
#endif

namespace sim::x86 {
namespace {

Recipe chain() { return {Recipe::kChain}; }
Recipe chain(Opcode first) { return {Recipe::kChain, first, {}, 1}; }
Recipe chain(Opcode first, Opcode second) { return {Recipe::kChain, first, second, 2}; }

}  // namespace

Recipe recipe(Op op) {
  switch (op) {
    case Op::kCopy:
      return chain();
    case Op::kNegate:
      return {Recipe::kMasked, kXor};
    case Op::kAbs:
      return {Recipe::kMasked, kAnd};
    case Op::kSqrt:
      return {Recipe::kSquareRoot};
    case Op::kAdd:
      return chain(kSum);
    case Op::kSubtract:
      return chain(kDifference);
    case Op::kMultiply:
      return chain(kProduct);
    case Op::kDivide:
      return chain(kQuotient);
    case Op::kMin:
      return {Recipe::kExtreme, kSmaller};
    case Op::kMax:
      return {Recipe::kExtreme, kLarger};
    case Op::kProductPlus:
      return {Recipe::kProductPlus};
    case Op::kProductMinus:
      return chain(kProduct, kDifference);
    case Op::kMinusProduct:
      return {Recipe::kMinusProduct};
    case Op::kSumPlus:
      return chain(kSum, kSum);
    case Op::kSumMinus:
      return chain(kSum, kDifference);
    case Op::kDifferencePlus:
      return chain(kDifference, kSum);
    case Op::kDifferenceMinus:
      return chain(kDifference, kDifference);
    case Op::kProductTimes:
      return chain(kProduct, kProduct);
    case Op::kSumTimes:
      return chain(kSum, kProduct);
    case Op::kDifferenceTimes:
      return chain(kDifference, kProduct);
    default:
      return {};
  }
}

CodePages::CodePages([[maybe_unused]] std::span<const unsigned char> bytes) {
#ifdef SIM_WRITES_CODE
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
#endif
}

CodePages::~CodePages() {
#ifdef SIM_WRITES_CODE
  if (pages_) ::munmap(pages_, bytes_);
#endif
}

CodePages::CodePages(CodePages&& other) noexcept
    : pages_(std::exchange(other.pages_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}

CodePages& CodePages::operator=(CodePages&& other) noexcept {
  std::swap(pages_, other.pages_);
  std::swap(bytes_, other.bytes_);
  return *this;
}

}  // namespace sim::x86
