#include "frame.h"

#include "crc.h"
#include "output.h"

namespace bifa {

namespace {
const uint8_t kHeadBytes = 2;
const uint8_t kCheckBytes = 4;

/// Both checks of a message, the first in the low half.
uint32_t checks(const uint8_t* bytes, uint8_t size, uint32_t seed) {
  uint16_t first = static_cast<uint16_t>(seed);
  uint16_t second = static_cast<uint16_t>(seed >> 16);
  for (uint8_t i = 0; i < size; ++i) {
    first = crc16_update(first, bytes[i]);
    second = crc16_reflected_update(second, bytes[i]);
  }
  return first | static_cast<uint32_t>(second) << 16;
}

bool is_open(uint8_t message) { return message < static_cast<uint8_t>(MessageId::kStatus); }
}  // namespace

void FrameDecoder::start() {
  mask_ = 0;
  length_ = 0;
  run_ = 0;
  zero_follows_ = false;
  bad_ = false;
}

void FrameDecoder::feed(uint8_t byte) {
  if (mask_ == 0) {
    mask_ = byte;
    return;
  }
  byte ^= mask_;
  uint8_t decoded = byte;
  if (run_ == 0) {
    const bool had_zero = zero_follows_;
    run_ = byte - 1;
    zero_follows_ = true;
    if (!had_zero) return;
    decoded = 0;
  } else {
    --run_;
  }
  if (length_ >= sizeof frame_) {
    bad_ = true;
    return;
  }
  reinterpret_cast<uint8_t*>(&frame_)[length_++] = decoded;
}

bool FrameDecoder::finish(uint32_t session) {
  uint8_t size;
  if (bad_ || run_ != 0) return false;
  if (!inward_size(frame_.message, size) || length_ != kHeadBytes + size + kCheckBytes) return false;
  uint32_t stored;
  memcpy(&stored, frame_.fields + size, sizeof stored);
  const uint32_t seed = is_open(frame_.message) ? kOpenSeed : session;
  return stored == checks(reinterpret_cast<const uint8_t*>(&frame_), kHeadBytes + size, seed);
}

void send_frame(MessageId message, uint8_t sequence, const void* fields, uint8_t size, uint32_t seed) {
  uint8_t body[kHeadBytes + kLongestOutward + kCheckBytes];
  body[0] = static_cast<uint8_t>(message);
  body[1] = sequence;
  if (size > 0) memcpy(body + kHeadBytes, fields, size);
  const uint32_t check = checks(body, kHeadBytes + size, seed);
  memcpy(body + kHeadBytes + size, &check, sizeof check);
  const uint8_t length = kHeadBytes + size + kCheckBytes;

  output(0);
  output(0);
  uint8_t begin = 0;
  while (begin <= length) {
    uint8_t end = begin;
    while (end < length && body[end] != 0) ++end;
    output(end - begin + 1);
    for (; begin < end; ++begin) output(body[begin]);
    ++begin;
  }
  output(0);
}

}  // namespace bifa
