// Frames: number of the message, sequence number, fields, two checks; COBS makes it free of 0x00, which delimits it.
// In a frame to the Uno the COBS bytes are under a mask (XOR), sent first, that leaves no `!` among them: what a bad line
// leaves of a frame is never a stop.
#pragma once

#include "message_table.h"

namespace bifa {

/// Seed of both checks (low and high half): what is meant differently at the two ends does not pass.
const uint32_t kOpenSeed = 0xFFFFFFFFUL;  ///< messages that any version understands
const uint32_t kStreamSeed = kTableHash;  ///< telemetry
/// Messages of a session: those of an earlier one, or from before a reset, do not pass.
inline uint32_t session_seed(uint16_t key) { return kTableHash ^ key ^ (static_cast<uint32_t>(key) << 16); }

/// A message as it came out of a frame.
struct Frame {
  uint8_t message;
  uint8_t sequence;
  uint8_t fields[kLongestInward + 4];  ///< the fields; while decoding also the checks
};

/// Takes the bytes of one frame as they come.
class FrameDecoder {
 public:
  void start();
  void feed(uint8_t byte);
  /// After the last byte. True: the message is one of the table, of exactly its length, and both checks are right.
  /// `session` is the seed of session messages.
  bool finish(uint32_t session);
  const Frame& frame() const { return frame_; }

 private:
  uint8_t length_;     ///< bytes decoded
  uint8_t mask_;       ///< 0: not yet known
  uint8_t run_;        ///< bytes to the next code byte
  bool zero_follows_;  ///< whether the present run ends in a 0x00
  bool bad_;
  Frame frame_;
};

/// Sends a message with its delimiters. The leading delimiter is doubled: one ends what may hang open at the receiver.
void send_frame(MessageId message, uint8_t sequence, const void* fields, uint8_t size, uint32_t seed);

/// Room that a frame with fields of `size` bytes takes in the output.
inline uint8_t frame_room(uint8_t size) { return 2 + 1 + 2 + size + 4 + 1; }

}  // namespace bifa
