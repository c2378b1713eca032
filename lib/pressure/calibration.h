// Calibration of a board: the zero offset of each sensor.
#pragma once

#include <stdint.h>

#include "chamber.h"

namespace bifa {

/// Zero offsets, in mpsi, that are subtracted from the sensors' readings.
struct Calibration {
  int16_t offset_mpsi[kChamberCount];
};

/// The ABP's total error band is 1.5 % of 30 psi (datasheet, table 5): more is a defect, not an offset.
const int16_t kGreatestOffset_mpsi = 900;

inline bool is_valid(const Calibration& calibration) {
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    const int16_t offset = calibration.offset_mpsi[i];
    if (offset > kGreatestOffset_mpsi || offset < -kGreatestOffset_mpsi) return false;
  }
  return true;
}

}  // namespace bifa
