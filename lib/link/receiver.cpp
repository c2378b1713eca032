#include "receiver.h"

#include "critical.h"

namespace bifa {

namespace {
const uint8_t kDelimiter = 0x00;
const uint8_t kOtherFrame = 0xFF;
}  // namespace

bool Receiver::push(uint8_t byte, bool damaged) {
  if (damaged) overrun_ = true;
  if (in_frame_ && (silence_ms_ > kSilenceMs || (frame_length_ == kLongestFrame && byte != kDelimiter))) {
    in_frame_ = false;
    put(kDelimiter);
  }
  silence_ms_ = 0;

  if (byte == '!' && (!in_frame_ || frame_length_ == 0)) {
    if (in_frame_) put(kDelimiter);  // no frame begins with `!`: the delimiter was a stray byte
    in_frame_ = false;
    return true;
  }
  if (!in_frame_) {
    if (byte == kDelimiter) {
      in_frame_ = true;
      frame_length_ = 0;
      stop_matched_ = 0;
    }
    put(byte);
    return false;
  }

  if (byte == kDelimiter) {
    if (frame_length_ == 0) return false;  // two delimiters in a row: the frame has not begun
    in_frame_ = false;
    put(byte);
    return false;
  }
  ++frame_length_;
  put(byte);
  if (stop_matched_ == kOtherFrame) return false;
  stop_matched_ = byte == flash_byte(&kStopFrame[stop_matched_]) ? stop_matched_ + 1 : kOtherFrame;
  if (stop_matched_ != sizeof kStopFrame) return false;
  stop_matched_ = kOtherFrame;
  return true;
}

void Receiver::put(uint8_t byte) {
  const uint8_t next = (head_ + 1) % kQueueBytes;
  if (overrun_ || next == tail_) {
    overrun_ = true;
    if (lost_ != 0xFFFF) ++lost_;
    return;
  }
  queue_[head_] = byte;
  head_ = next;
}

bool Receiver::pop(uint8_t& byte) {
  if (head_ == tail_) return false;
  if (outdated_ > 0) {
    const Critical guard;  // a stop may set it at any time
    --outdated_;
  }
  byte = queue_[tail_];
  tail_ = (tail_ + 1) % kQueueBytes;
  return true;
}

uint16_t Receiver::lost() const {
  const Critical guard;  // two bytes: an interrupt between them may change the count
  return lost_;
}

bool Receiver::recover() {
  overrun_ = false;
  return in_frame_;
}

}  // namespace bifa
