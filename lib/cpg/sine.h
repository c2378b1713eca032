// Sine of an angle in turns / 2^16, for the CPG: table of a quarter turn, linear interpolation.
#pragma once

#include "flash.h"

namespace bifa {

/// The value of sine() that represents 1. Chosen so that the sum of two sines and its extrapolation fit 16 bits, and
/// the step between two entries of the table fits 8 bits, which makes the interpolation a single multiplication.
const int16_t kSineOne = 16000;

const uint8_t kSineSteps = 128;                    ///< of a quarter turn
extern const uint16_t kSineTable[kSineSteps + 2];  ///< one beyond the quarter: read at its end, multiplied by 0

/// kSineOne * sin(2 pi angle / 2^16). Greatest error 2 (1.2e-4 of 1); exactly odd.
inline __attribute__((always_inline)) int16_t sine(uint16_t angle) {
  uint16_t place = angle << 1;         // position in the half turn
  if (place & 0x8000) place = -place;  // the second quarter mirrors the first
  const uint8_t fraction = static_cast<uint8_t>(place);
  const uint16_t* entry = &kSineTable[static_cast<uint8_t>(place >> 8)];
  const uint16_t left = flash_word(entry);
  const uint8_t step = static_cast<uint8_t>(flash_byte(entry + 1) - left);  // little-endian: its low byte
  const uint16_t value = left + static_cast<uint8_t>(static_cast<uint16_t>(step * fraction) >> 8);
  return angle & 0x8000 ? -static_cast<int16_t>(value) : static_cast<int16_t>(value);
}

}  // namespace bifa
