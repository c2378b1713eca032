#include "gait.h"

#include "sine.h"

namespace bifa {

namespace {

const uint32_t kStep_us = 1000;
const uint32_t kFullTurn_mdeg = 360000;
const uint16_t kFullDuty_e4 = 10000;

/// 2^32 256 / (2 pi kSineOne) for a coupling of 0.001 / s and 1 ms, times 2^14.
const uint32_t kGainScale = 179193;
/// Up to here the finer gain fits 16 bits.
const uint16_t kWeakCoupling_milli_per_s = 5900;

/// 2^32 numerator / denominator, rounded, for a proper fraction; bit by bit. denominator < 2^31.
uint32_t divide(uint32_t numerator, uint32_t denominator) {
  uint32_t quotient = 0;
  for (uint8_t bit = 0; bit < 32; ++bit) {
    quotient <<= 1;
    numerator <<= 1;
    if (numerator >= denominator) {
      numerator -= denominator;
      quotient |= 1;
    }
  }
  return numerator >= denominator - numerator ? quotient + 1 : quotient;
}

uint32_t turns(uint32_t angle_mdeg) { return divide(angle_mdeg % kFullTurn_mdeg, kFullTurn_mdeg); }

}  // namespace

Gait gait_of(const ParameterSet& set) {
  Gait gait;
  gait.increment = divide(kStep_us, set.period_us);
  gait.strong = set.coupling_milli_per_s > kWeakCoupling_milli_per_s;
  const uint8_t shift = gait.strong ? 16 : 14;
  gait.gain = static_cast<uint16_t>((set.coupling_milli_per_s * kGainScale + (1UL << (shift - 1))) >> shift);
  gait.psi12 = turns(set.psi12_mdeg) - kHalfStep;
  gait.psi13 = turns(set.psi13_mdeg) - kHalfStep;
  const uint16_t duties_e4[kChamberCount] = {set.duty_body_e4, set.duty_head_e4, set.duty_tail_e4};
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    gait.threshold[i] = duties_e4[i] >= kFullDuty_e4 ? UINT32_MAX : divide(duties_e4[i], kFullDuty_e4);
  }
  return gait;
}

}  // namespace bifa
