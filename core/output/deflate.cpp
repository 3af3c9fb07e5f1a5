#include "core/output/deflate.h"

#include <zlib.h>

#include <utility>

#include "core/base/error.h"

namespace sim {

namespace {

[[noreturn]] void fail_compression() {
  throw Error(ErrorKind::kIo, {"cannot compress", "", "no memory", ""});
}

}  // namespace

std::string deflated(std::string_view bytes, int level) {
  uLongf size = compressBound(bytes.size());
  std::string out(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), level) != Z_OK)
    fail_compression();
  out.resize(size);
  return out;
}

Deflater::Deflater(int level, std::size_t most)
    : stream_(std::make_unique<z_stream>()), most_(most) {
  if (deflateInit(stream_.get(), level) != Z_OK) fail_compression();
}

Deflater::~Deflater() { deflateEnd(stream_.get()); }

void Deflater::add(std::string_view bytes) {
  while (!bytes.empty() && !full_) {  // zlib counts in 32 bits
    const std::string_view part = bytes.substr(0, 1U << 30);
    stream_->next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(part.data()));
    stream_->avail_in = static_cast<uInt>(part.size());
    run(Z_NO_FLUSH);
    bytes.remove_prefix(part.size());
  }
}

std::string Deflater::finish() {
  run(Z_FINISH);
  return std::move(out_);
}

void Deflater::run(int flush) {
  char block[1 << 16];
  do {
    stream_->next_out = reinterpret_cast<Bytef*>(block);
    stream_->avail_out = sizeof block;
    if (deflate(stream_.get(), flush) == Z_STREAM_ERROR) fail_compression();
    const std::size_t count = sizeof block - stream_->avail_out;
    full_ = full_ || out_.size() + count > most_;
    if (full_)
      out_.clear();
    else
      out_.append(block, count);
  } while (stream_->avail_out == 0);
}

std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before) {
  uLong sum = before;
  while (!bytes.empty()) {  // zlib counts in 32 bits
    const std::size_t part = bytes.size() < (1U << 30) ? bytes.size() : 1U << 30;
    sum = crc32(sum, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(part));
    bytes.remove_prefix(part);
  }
  return static_cast<std::uint32_t>(sum);
}

std::uint32_t joined_crc32(std::uint32_t first, std::uint32_t second, std::uint64_t bytes) {
  return static_cast<std::uint32_t>(crc32_combine(first, second, static_cast<z_off_t>(bytes)));
}

}  // namespace sim
