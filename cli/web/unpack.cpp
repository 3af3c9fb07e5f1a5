// The decoder of LZMA that a page unpacks its kernel with: a module of WebAssembly of its own, of a
// few kilobytes. Browsers have one of gzip alone, and the kernel is a quarter smaller in LZMA.
//
// Source: Pavlov (2015), LZMA specification. The stream has lp = 0 and pb = 0; lc is given.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <new>

namespace {

constexpr int kStates = 12, kMostLiteralBits = 4;

// The probability of a 0, in 2048ths.
using Odds = std::uint16_t;
template <std::size_t kCount>
struct Table {
  std::array<Odds, kCount> odds;
  Table() { odds.fill(1024); }
  Odds& operator[](std::size_t i) { return odds[i]; }
};

class RangeDecoder {
 public:
  RangeDecoder(const std::uint8_t* at, const std::uint8_t* end) : at_(at + 1), end_(end) {
    for (int i = 0; i < 4; ++i) code_ = code_ << 8 | next();
  }

  unsigned bit(Odds& odds) {
    const std::uint32_t bound = (range_ >> 11) * odds;
    const bool one = code_ >= bound;
    if (one) {
      range_ -= bound;
      code_ -= bound;
      odds = static_cast<Odds>(odds - (odds >> 5));
    } else {
      range_ = bound;
      odds = static_cast<Odds>(odds + ((2048 - odds) >> 5));
    }
    normalize();
    return one;
  }
  // Bits of even odds.
  std::uint32_t direct(int bits) {
    std::uint32_t sum = 0;
    for (; bits > 0; --bits) {
      range_ >>= 1;
      const bool one = code_ >= range_;
      if (one) code_ -= range_;
      sum = sum << 1 | one;
      normalize();
    }
    return sum;
  }
  // A number whose bits have their own odds below those before, the highest first.
  std::uint32_t tree(Odds* odds, int bits) {
    std::uint32_t m = 1;
    for (int i = 0; i < bits; ++i) m = m << 1 | bit(odds[m]);
    return m - (1U << bits);
  }
  std::uint32_t reverse_tree(Odds* odds, int bits) {  // the lowest first
    std::uint32_t m = 1, sum = 0;
    for (int i = 0; i < bits; ++i) {
      const unsigned b = bit(odds[m]);
      m = m << 1 | b;
      sum |= b << i;
    }
    return sum;
  }

 private:
  std::uint32_t next() { return at_ < end_ ? *at_++ : 0; }
  void normalize() {
    if (range_ >= 1U << 24) return;
    range_ <<= 8;
    code_ = code_ << 8 | next();
  }

  const std::uint8_t *at_, *end_;
  std::uint32_t range_ = 0xFFFFFFFF, code_ = 0;
};

struct Lengths {
  Table<2> choice;
  Table<8> low, mid;
  Table<256> high;

  std::uint32_t read(RangeDecoder& in) {
    if (!in.bit(choice[0])) return in.tree(&low[0], 3);
    if (!in.bit(choice[1])) return 8 + in.tree(&mid[0], 3);
    return 16 + in.tree(&high[0], 8);
  }
};

struct Distances {
  std::array<Table<64>, 4> slots;
  Table<128> middle;
  Table<16> low;

  std::uint32_t read(RangeDecoder& in, std::uint32_t length) {
    const std::uint32_t slot = in.tree(&slots[std::min(length, 3U)][0], 6);
    if (slot < 4) return slot;
    const int bits = static_cast<int>(slot / 2) - 1;
    const std::uint32_t base = (2 | (slot & 1)) << bits;
    if (slot < 14) return base + in.reverse_tree(&middle[base - slot], bits);
    const std::uint32_t high = in.direct(bits - 4) << 4;
    return base + high + in.reverse_tree(&low[0], 4);
  }
};

struct Decoder {
  RangeDecoder in;
  std::uint8_t* out;
  std::uint32_t size;
  int literal_bits;
  std::uint32_t written = 0;
  std::size_t state = 0;
  std::array<std::uint32_t, 4> recent{};  // distances less 1
  Table<0x300 << kMostLiteralBits> literals{};
  Table<kStates> match{}, again{}, last{}, second{}, third{}, one{};
  Lengths lengths{}, lengths_again{};
  Distances distances{};

  std::uint8_t literal(Odds* odds) {
    std::uint32_t m = 1;
    while (m < 256) m = m << 1 | in.bit(odds[m]);
    return static_cast<std::uint8_t>(m);
  }
  // After a match: its next byte is probably not this one, which tells something of its bits.
  std::uint8_t literal_unlike(Odds* odds, std::uint32_t other) {
    std::uint32_t m = 1;
    for (bool same = true; m < 256;) {
      other <<= 1;
      const std::uint32_t wanted = other >> 8 & 1;
      const unsigned b = in.bit(same ? odds[((1 + wanted) << 8) + m] : odds[m]);
      m = m << 1 | b;
      same = same && b == wanted;
    }
    return static_cast<std::uint8_t>(m);
  }

  // Goes on until `enough` bytes are there. False where the stream cannot be one.
  bool run(std::uint32_t enough) {
    while (written < enough) {
      if (!in.bit(match[state])) {
        const std::uint32_t before = written > 0 ? out[written - 1] : 0;
        Odds* odds = &literals[0x300 * (before >> (8 - literal_bits))];
        out[written] =
            state < 7 ? literal(odds) : literal_unlike(odds, out[written - recent[0] - 1]);
        ++written;
        state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
        continue;
      }
      std::uint32_t length = 1;
      if (!in.bit(again[state])) {
        std::rotate(recent.begin(), recent.end() - 1, recent.end());
        length = lengths.read(in) + 2;
        recent[0] = distances.read(in, length - 2);
        state = state < 7 ? 7 : 10;
      } else {
        bool single = false;
        if (!in.bit(last[state])) {
          single = !in.bit(one[state]);
        } else {
          const int which = !in.bit(second[state]) ? 1 : !in.bit(third[state]) ? 2 : 3;
          std::rotate(recent.begin(), recent.begin() + which, recent.begin() + which + 1);
        }
        if (!single) length = lengths_again.read(in) + 2;
        state = single ? (state < 7 ? 9 : 11) : state < 7 ? 8 : 11;
      }
      if (recent[0] >= written || length > size - written) return false;
      for (; length > 0; --length, ++written) out[written] = out[written - recent[0] - 1];
    }
    return true;
  }
};

constexpr std::uint32_t kAtOnce = 1 << 16;  // bytes of a call

}  // namespace

// The memory belongs to who calls: a Decoder is put where unpack_begin() is told, in so many bytes.
extern "C" {

[[gnu::used]] std::uint32_t unpack_room() { return sizeof(Decoder); }

// For `packed` bytes at `data`, which stand for `size` bytes that go to `out`.
[[gnu::used]] void unpack_begin(void* place, const std::uint8_t* data, std::uint32_t packed,
                                std::uint8_t* out, std::uint32_t size, int literal_bits) {
  new (place) Decoder{.in = {data, data + packed},
                      .out = out,
                      .size = size,
                      .literal_bits = std::clamp(literal_bits, 0, kMostLiteralBits)};
}

// A part of it, because engines make a function quick from one call to the next: 1 if there is
// more, 0 at the end, -1 if the stream is broken.
[[gnu::used]] int unpack_more(Decoder* decoder) {
  const std::uint32_t left = decoder->size - decoder->written;
  if (!decoder->run(decoder->written + std::min(left, kAtOnce))) return -1;
  return decoder->written < decoder->size;
}

}  // extern "C"
