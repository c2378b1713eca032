#include "gait.h"

#include "sine.h"

namespace bifa {

namespace {

const uint32_t kStep_us = 1000;
const uint32_t kFullTurn_mdeg = 360000;
const uint16_t kFullDuty_e4 = 10000;

/// 2^32 kSineOne^-1 64 / (2 pi 1000) for a coupling of 0.001 / s and 1 ms, times 2^16.
const uint32_t kGainScale = 179193;

struct Fraction {
  uint32_t whole;    ///< numerator / denominator * 2^32, rounded down
  uint8_t fraction;  ///< and its next 8 bits
};

/// Long division of a proper fraction, bit by bit; denominator < 2^31.
Fraction divide(uint32_t numerator, uint32_t denominator) {
  Fraction result = {0, 0};
  for (uint8_t bit = 0; bit < 40; ++bit) {
    result.whole = result.whole << 1 | result.fraction >> 7;
    result.fraction = static_cast<uint8_t>(result.fraction << 1);
    numerator <<= 1;
    if (numerator >= denominator) {
      numerator -= denominator;
      result.fraction |= 1;
    }
  }
  return result;
}

uint32_t turns(uint32_t angle_mdeg) { return divide(angle_mdeg % kFullTurn_mdeg, kFullTurn_mdeg).whole; }

}  // namespace

Gait gait_of(const ParameterSet& set) {
  Gait gait;
  const Fraction increment = divide(kStep_us, set.period_us);
  gait.increment = increment.whole;
  gait.increment_fraction = increment.fraction;
  gait.gain = static_cast<uint16_t>((set.coupling_milli_per_s * kGainScale + 0x8000) >> 16);
  gait.psi12 = turns(set.psi12_mdeg);
  gait.psi13 = turns(set.psi13_mdeg);
  const uint16_t duties_e4[kChamberCount] = {set.duty_body_e4, set.duty_head_e4, set.duty_tail_e4};
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    gait.never_positive[i] = duties_e4[i] >= kFullDuty_e4;
    gait.threshold[i] = gait.never_positive[i] ? 0 : divide(duties_e4[i], kFullDuty_e4).whole;
  }
  return gait;
}

}  // namespace bifa
