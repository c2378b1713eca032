#include "oscillators.h"

#include <string.h>

#include "sine.h"

// step() runs a thousand times a second, so its parts are inlined; it is small enough to be inlined in turn into its
// only caller, the tick.
#define BIFA_INLINE inline __attribute__((always_inline))

namespace bifa {

namespace {

/// The upper half of an error (both machines are little-endian). Loading only that half saves registers on an AVR.
BIFA_INLINE uint16_t upper(const uint32_t& error) {
  uint16_t half;
  memcpy(&half, reinterpret_cast<const uint8_t*>(&error) + 2, sizeof half);
  return half;
}

/// Eq. (10): u = 1 beyond the threshold. Setting the lowest bit makes a duty of 0 (threshold 0) always positive and a
/// duty of 1 (threshold 2^32 - 1) never.
BIFA_INLINE bool is_positive(uint32_t phase, uint32_t threshold) { return (phase | 1) > threshold; }

}  // namespace

void Oscillators::use(const Gait& gait) {
  const uint32_t body = phase(0);
  const uint32_t head = phase(1);
  const uint32_t tail = phase(2);
  gait_ = gait;
  place(body, head, tail);
}

void Oscillators::place(uint32_t body, uint32_t head, uint32_t tail) {
  body_ = body + gait_.increment / 2;
  head_error_ = head - body - gait_.psi12;
  tail_error_ = tail - body - gait_.psi13;
  motion_ = Motion::kBegins;
  fraction_ = 0;
}

void Oscillators::settle() {
  body_ = gait_.increment / 2;
  head_error_ = kHalfStep;
  tail_error_ = kHalfStep;
  motion_ = Motion::kBegins;
}

uint32_t Oscillators::phase(uint8_t chamber) const {
  const uint32_t body = body_ - gait_.increment / 2;
  if (chamber == 1) return body + gait_.psi12 + head_error_;
  if (chamber == 2) return body + gait_.psi13 + tail_error_;
  return body;
}

BIFA_INLINE Oscillators::Pulls Oscillators::pulls(uint16_t head_error, uint16_t tail_error) {
  const int16_t body_head = sine(head_error);
  const int16_t body_tail = sine(tail_error);
  const int16_t head_tail = sine(tail_error - head_error);
  return {static_cast<int16_t>(body_head + body_tail), static_cast<int16_t>(head_tail - body_head)};
}

/// Phase increment due to the extrapolated pull.
BIFA_INLINE uint32_t Oscillators::advance(int16_t pull, int16_t last) const {
  const int16_t extrapolated = pull + (pull - last) / 2;
  return static_cast<uint32_t>((static_cast<int32_t>(extrapolated) * gait_.gain) >> 8);
}

/// Applies the coupling for one step; returns by how much it advances the body.
BIFA_INLINE uint32_t Oscillators::couple() {
  if (motion_ == Motion::kSettled) return 0;
  const uint16_t head_error = upper(head_error_);
  const uint16_t tail_error = upper(tail_error_);
  const Pulls now = pulls(head_error, tail_error);
  if (motion_ == Motion::kBegins) last_ = now;
  motion_ = Motion::kGoesOn;
  if ((head_error | tail_error) == 0 && (last_.body | last_.head) == 0) motion_ = Motion::kSettled;
  uint32_t body = advance(now.body, last_.body);
  uint32_t head = advance(now.head, last_.head);
  last_ = now;
  int8_t n = gait_.doublings;
  if (n > 0) {
    do {
      body += body;
      head += head;
    } while (--n != 0);
  } else {
    for (; n < 0; ++n) {
      body = static_cast<uint32_t>(static_cast<int32_t>(body) >> 1);
      head = static_cast<uint32_t>(static_cast<int32_t>(head) >> 1);
    }
  }
  // The pulls sum to zero, so the tail's is -(body + head), and the mean of the phases advances at exactly f.
  head_error_ += head - body;
  tail_error_ -= head + body + body;
  return body;
}

void Oscillators::step() {
  uint32_t body = couple();
  body += body_ + gait_.increment;
  const uint8_t fraction = fraction_;
  fraction_ = fraction + gait_.increment_fraction;
  if (fraction_ < fraction) ++body;
  body_ = body;
  uint8_t outputs = 0;
  if (is_positive(gait_.psi12 + head_error_ + body, gait_.threshold[1])) outputs |= 2;
  if (is_positive(gait_.psi13 + tail_error_ + body, gait_.threshold[2])) outputs |= 4;
  if (is_positive(body, gait_.threshold[0])) outputs |= 1;
  outputs_ = outputs;
}

}  // namespace bifa
