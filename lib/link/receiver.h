// Receives the bytes from the host in the receive interrupt: separates frames from text, acts on stops, queues the
// rest.
//
// Text and frames share the port; a frame is enclosed in 0x00 bytes. A frame ends at its delimiter, at its maximum
// length or after 20 ms of silence, so that a stray 0x00 cannot hide a `!` for long; and no frame begins with `!`, so
// that a stray 0x00 cannot hide one that follows immediately. In the queue, every frame has exactly one 0x00 before and
// one after it, whatever was received.
#pragma once

#include "message_table.h"

namespace bifa {

/// Maximum length of a frame to the Uno between its delimiters: mask, COBS, number, sequence, fields, two checks.
const uint8_t kLongestFrame = 1 + 1 + 2 + kLongestInward + 4;

class Receiver {
 public:
  /// Takes one byte; call in the receive interrupt. Returns true for a stop, to be executed at once. `damaged`: its
  /// stop bit was missing, or bytes before it were lost.
  bool push(uint8_t byte, bool damaged = false);

  /// Counts the silence; call every millisecond.
  void tick() {
    if (silence_ms_ <= kSilenceMs) ++silence_ms_;
  }

  /// Takes the next byte from the queue; false if it is empty.
  bool pop(uint8_t& byte);

  // Call these with interrupts off:
  /// Marks the queue's contents as older than a stop or fault.
  void outdate() { outdated_ = static_cast<uint8_t>(head_ - tail_) % kQueueBytes; }
  /// Whether the next byte came before the last stop or fault.
  bool outdated() const { return outdated_ > 0; }

  bool has_input() const { return head_ != tail_; }

  /// Whether bytes were lost or damaged. If so, nothing more is queued until the queue is empty and recover() is
  /// called.
  bool overrun() const { return overrun_; }
  /// Resumes queueing (with interrupts off); returns whether the next byte belongs to a frame.
  bool recover();

  /// Lower bound of the number of bytes lost so far, up to 65535.
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
  volatile uint8_t outdated_ = 0;  ///< how many bytes in the queue are older than the last stop or fault
  bool in_frame_ = false;
  uint8_t frame_length_ = 0;
  uint8_t stop_matched_ = 0;  ///< how many bytes of the frame are those of the stop message; 0xFF: it is another
  uint8_t queue_[kQueueBytes];
};

}  // namespace bifa
