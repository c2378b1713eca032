#include "gait.h"

#include "constants.h"
#include "sine.h"

namespace bifa {

namespace {

const uint32_t kFullTurn_mdeg = 360000;
const uint16_t kFullDuty_e4 = 10000;

/// 2^32 64 / (2 pi kSineOne) for a coupling of 0.001 / s and 1 ms, times 2^16.
const uint32_t kGainScale = 179193;

struct Fraction {
  uint32_t whole;  ///< numerator / denominator * 2^32, rounded down
  uint8_t rest;    ///< the next 8 bits
};

/// Divides bit by bit; the quotient must be a proper fraction, the denominator < 2^31.
__attribute__((noinline)) Fraction divide(uint32_t numerator, uint32_t denominator) {
  Fraction quotient = {0, 0};
  for (uint8_t bit = 0; bit < 40; ++bit) {
    quotient.whole = quotient.whole << 1 | quotient.rest >> 7;
    quotient.rest = static_cast<uint8_t>(quotient.rest << 1);
    numerator <<= 1;
    if (numerator >= denominator) {
      numerator -= denominator;
      quotient.rest |= 1;
    }
  }
  return quotient;
}

uint32_t turns(uint32_t angle_mdeg) { return divide(angle_mdeg % kFullTurn_mdeg, kFullTurn_mdeg).whole; }

}  // namespace

Gait gait_of(const ParameterSet& set) {
  Gait gait;
  const Fraction increment = divide(kTick_us, set.period_us);
  gait.increment = increment.whole;
  gait.increment_fraction = increment.rest;
  uint32_t gain = set.coupling_milli_per_s * kGainScale;  // below 2^32 up to 23.9 / s
  gait.doublings = 2;
  while (gain != 0 && gain < 0x80000000UL) {
    gain <<= 1;
    --gait.doublings;
  }
  gait.gain = static_cast<uint16_t>(gain >> 16);
  gait.psi12 = turns(set.psi12_mdeg) - kHalfStep;
  gait.psi13 = turns(set.psi13_mdeg) - kHalfStep;
  const uint16_t duties_e4[kChamberCount] = {set.duty_body_e4, set.duty_head_e4, set.duty_tail_e4};
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    gait.threshold[i] = duties_e4[i] >= kFullDuty_e4 ? UINT32_MAX : divide(duties_e4[i], kFullDuty_e4).whole;
  }
  return gait;
}

}  // namespace bifa
