// The first to see a byte from the host, in the receive interrupt: tells frames from text, acts on stops, queues the
// rest.
//
// Text and frames share the port; a frame stands between 0x00 bytes. A frame ends at its delimiter, at its greatest
// length or after 20 ms of silence, so that a stray 0x00 cannot hide a `!` for long; and no frame begins with `!`, so that
// it cannot hide one that follows at once. In the queue every frame stands between exactly one 0x00 and another, whatever
// came over the line.
#pragma once

#include "message_table.h"

namespace bifa {

/// Greatest length of a frame to the Uno between its delimiters: mask, COBS, number, sequence, fields, two checks.
const uint8_t kLongestFrame = 1 + 1 + 2 + kLongestInward + 4;

class Receiver {
 public:
  /// Takes one byte; to be called in the receive interrupt. True: stop at once. `damaged`: its stop bit was missing, or
  /// others before it were lost.
  bool push(uint8_t byte, bool damaged = false);

  /// Counts the silence; call it once a millisecond.
  void tick() {
    if (silence_ms_ <= kSilenceMs) ++silence_ms_;
  }

  /// Takes the next byte out of the queue; false if it is empty.
  bool pop(uint8_t& byte);

  // With interrupts off:
  /// What stands in the queue came before a stop or a fault.
  void outdate() { outdated_ = static_cast<uint8_t>(head_ - tail_) % kQueueBytes; }
  /// Whether the next byte came before the last of them.
  bool outdated() const { return outdated_ > 0; }

  bool has_input() const { return head_ != tail_; }

  /// Whether bytes were lost or damaged. Then nothing more is queued until the queue is empty and recover() called.
  bool overrun() const { return overrun_; }
  /// Starts to queue again (with interrupts off); returns whether the next byte belongs to a frame.
  bool recover();

  /// How many bytes were lost so far, at least, up to 65535.
  uint16_t lost() const;

 private:
  static const uint8_t kSilenceMs = 20;
  static const uint8_t kQueueBytes = 128;

  void put(uint8_t byte);

  volatile uint8_t head_ = 0;
  volatile uint8_t tail_ = 0;
  volatile bool overrun_ = false;
  volatile uint8_t silence_ms_ = 0;
  uint16_t lost_ = 0;
  volatile uint8_t outdated_ = 0;  ///< how many of the bytes in the queue
  bool in_frame_ = false;
  uint8_t frame_length_ = 0;
  uint8_t stop_matched_ = 0;  ///< how many bytes of the frame are those of the stop message; 0xFF: it is another
  uint8_t queue_[kQueueBytes];
};

}  // namespace bifa
