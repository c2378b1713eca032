// Frames: number of the message, sequence number, fields, two checks. COBS removes 0x00, which delimits the frame.
// In a frame to the Uno the COBS bytes are masked (XOR); the mask is sent first and chosen so that no byte is `!`:
// fragments of a frame on a bad line never act as a stop.
#pragma once

#include "message_table.h"

namespace bifa {

/// Seed of both checks (low and high half): messages with a different meaning at the two ends are rejected.
const uint32_t kOpenSeed = 0xFFFFFFFFUL;  ///< messages that any version understands
const uint32_t kStreamSeed = kTableHash;  ///< telemetry
/// Messages of a session: those of an earlier session, or from before a reset, are rejected.
inline uint32_t session_seed(uint16_t key) { return kTableHash ^ key ^ (static_cast<uint32_t>(key) << 16); }

/// A decoded message.
struct Frame {
  uint8_t message;
  uint8_t sequence;
  uint8_t fields[kLongestInward + 4];  ///< the fields; while decoding also the checks
};

/// Decodes one frame byte by byte.
class FrameDecoder {
 public:
  void start();
  void feed(uint8_t byte);
  /// Call after the last byte. Returns true if the message is in the table, has exactly its length, and both checks
  /// match. `session` is the seed of session messages.
  bool finish(uint32_t session);
  const Frame& frame() const { return frame_; }

 private:
  uint8_t length_;     ///< bytes decoded
  uint8_t mask_;       ///< 0: not yet known
  uint8_t run_;        ///< bytes until the next code byte
  bool zero_follows_;  ///< whether the present run ends in a 0x00
  bool bad_;
  Frame frame_;
};

/// Sends a message with its delimiters. The leading delimiter is doubled: the first closes a frame left open at the
/// receiver.
void send_frame(MessageId message, uint8_t sequence, const void* fields, uint8_t size, uint32_t seed);

/// Bytes that a frame with fields of `size` bytes takes in the output.
inline uint8_t frame_room(uint8_t size) { return 2 + 1 + 2 + size + 4 + 1; }

}  // namespace bifa
