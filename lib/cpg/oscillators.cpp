#include "oscillators.h"

#include "sine.h"

namespace bifa {

void Oscillators::place(uint32_t body, uint32_t head, uint32_t tail) {
  phase_[0] = body;
  phase_[1] = head;
  phase_[2] = tail;
  fraction_ = 0;
  first_ = true;
}

namespace {

/// What the pull of a step and of the one before it (sums of sines) add to a phase.
inline int32_t advance(int16_t pull, int16_t& before, uint16_t gain) {
  const int16_t extrapolated = pull + (pull - before) / 2;
  before = pull;
  return ((static_cast<int32_t>(extrapolated) * gain) >> 8) * 4;
}

}  // namespace

void Oscillators::step() {
  const uint32_t head_error = phase_[1] - phase_[0] - gait_.psi12;
  const uint32_t tail_error = phase_[2] - phase_[0] - gait_.psi13;
  const int16_t body_head = sine(head_error);
  const int16_t body_tail = sine(tail_error);
  const int16_t head_tail = sine(tail_error - head_error);
  const int16_t pull_body = body_head + body_tail;
  const int16_t pull_head = head_tail - body_head;
  if (first_) {
    pull_body_ = pull_body;
    pull_head_ = pull_head;
    first_ = false;
  }
  const int32_t body = advance(pull_body, pull_body_, gait_.gain);
  const int32_t head = advance(pull_head, pull_head_, gait_.gain);

  uint32_t increment = gait_.increment;
  const uint8_t fraction = fraction_;
  fraction_ = static_cast<uint8_t>(fraction + gait_.increment_fraction);
  if (fraction_ < fraction) ++increment;
  phase_[0] += increment + body;
  phase_[1] += increment + head;
  phase_[2] += increment - body - head;  // what they pull adds up to nothing: the mean runs at exactly f
}

}  // namespace bifa
