// Damages millions of frames and counts how often the Uno's receiver and decoder accept something that was not sent.
#include <vector>

#include "crc.h"
#include "frame.h"
#include "output.h"
#include "receiver.h"

namespace {

struct Random {
  uint64_t state;
  uint32_t next() {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return static_cast<uint32_t>(state >> 16);
  }
  uint32_t below(uint32_t n) { return static_cast<uint32_t>((static_cast<uint64_t>(next()) * n) >> 32); }
};

// Damages a share of `rate_e4` / 10000 of the bytes, sometimes in bursts: flips a bit, or replaces, doubles, drops or
// inserts a byte. Returns whether anything changed.
bool damage(Random& random, std::vector<uint8_t>& bytes, uint32_t rate_e4) {
  std::vector<uint8_t> out;
  uint32_t burst = 0;
  for (uint8_t byte : bytes) {
    if (burst == 0 && random.below(10000) >= rate_e4) {
      out.push_back(byte);
      continue;
    }
    burst = burst > 0 ? burst - 1 : random.below(20) == 0 ? random.below(10) : 0;
    switch (random.below(5)) {
      case 0:
        out.push_back(byte ^ (1 << random.below(8)));
        break;
      case 1:
        out.push_back(byte ^ (1 + random.below(255)));
        break;
      case 2:
        out.push_back(byte);
        out.push_back(byte);
        break;
      case 3:
        out.push_back(byte);
        out.push_back(random.below(256));
        break;
      default:
        break;
    }
  }
  const bool changed = out != bytes;
  bytes = out;
  return changed;
}

std::vector<uint8_t> sent;

}  // namespace

void bifa::output(uint8_t byte) { sent.push_back(byte); }

extern "C" {

uint16_t harness_crc(const uint8_t* data, size_t size, uint16_t crc) {
  for (size_t i = 0; i < size; ++i) crc = bifa::crc16_update(crc, data[i]);
  return crc;
}
uint16_t harness_reflected(const uint8_t* data, size_t size, uint16_t crc) {
  for (size_t i = 0; i < size; ++i) crc = bifa::crc16_reflected_update(crc, data[i]);
  return crc;
}

// Decodes one frame, given without its delimiters; returns the size of its fields, or -1 if it is rejected.
int harness_decode(const uint8_t* data, size_t size, uint32_t session, uint8_t* frame) {
  bifa::FrameDecoder decoder;
  decoder.start();
  for (size_t i = 0; i < size; ++i) decoder.feed(data[i]);
  if (!decoder.finish(session)) return -1;
  uint8_t fields = 0;
  bifa::inward_size(decoder.frame().message, fields);
  memcpy(frame, &decoder.frame(), 2 + fields);
  return fields;
}

size_t harness_encode(uint8_t message, uint8_t sequence, const uint8_t* fields, uint8_t size, uint32_t seed, uint8_t* to) {
  sent.clear();
  bifa::send_frame(static_cast<bifa::MessageId>(message), sequence, fields, size, seed);
  memcpy(to, sent.data(), sent.size());
  return sent.size();
}

// Returns how often the receiver, after `before`, recognizes a stop in `data`.
int harness_stops(const uint8_t* before, size_t before_size, const uint8_t* data, size_t size) {
  bifa::Receiver receiver;
  uint8_t out;
  for (size_t i = 0; i < before_size; ++i) {
    receiver.push(before[i]);
    while (receiver.pop(out)) {
    }
  }
  int stops = 0;
  for (size_t i = 0; i < size; ++i) stops += receiver.push(data[i]);
  return stops;
}

// Pushes good frames, most of them damaged, through the receiver until `count` were damaged. `pool`: entries of
// `stride` bytes: the frame's size, the frame, and at the end the message that it holds. A message that comes out
// must be that of one of the last two frames. results: damaged, accepted as sent, accepted wrongly, stops.
void harness_damage(const uint8_t* pool, size_t frames, size_t stride, uint32_t session, uint64_t seed, uint64_t count,
                    uint64_t* results) {
  Random random = {seed * 2654435761u + 88172645463325252ull};
  bifa::Receiver receiver;
  bifa::FrameDecoder decoder;
  bool in_frame = false;
  std::vector<uint8_t> last[2];
  for (uint64_t i = 0; i < count;) {
    const uint8_t* entry = pool + stride * random.below(frames);
    std::vector<uint8_t> bytes(entry + 1, entry + 1 + entry[0]);
    last[0] = last[1];
    last[1].assign(entry + stride - 24, entry + stride);  // the message that it holds, padded with zeros
    const uint32_t rates[] = {300, 1000, 3000};
    const bool damaged = damage(random, bytes, rates[random.below(3)]);
    i += damaged;
    for (uint8_t byte : bytes) {
      if (receiver.push(byte)) ++results[3];
      uint8_t out;
      while (receiver.pop(out)) {
        if (out != 0) {
          if (in_frame) decoder.feed(out);
          continue;
        }
        in_frame = !in_frame;
        if (in_frame) {
          decoder.start();
          continue;
        }
        if (!decoder.finish(session)) continue;
        uint8_t size = 0;
        bifa::inward_size(decoder.frame().message, size);
        std::vector<uint8_t> got(24, 0);
        memcpy(got.data(), &decoder.frame(), 2 + size);
        const bool known = got == last[0] || got == last[1];
        ++results[known ? 1 : 2];
      }
    }
  }
  results[0] = count;
}
}
