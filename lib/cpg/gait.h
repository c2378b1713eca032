// A gait in the units of the integer CPG: phases in turns / 2^32, steps of 1 ms.
#pragma once

#include "chamber.h"
#include "parameter_table.h"

namespace bifa {

/// The oscillators use the upper 16 bits of an error; adding half of the last of these bits rounds it.
const uint32_t kHalfStep = 0x8000;

struct Gait {
  uint32_t increment;          ///< of every phase per step: 2^32 f / 1000
  uint8_t increment_fraction;  ///< in 1/256 of that unit: the period is exact to 0.06 ppm
  uint16_t gain;               ///< added per step by a sine of 1 / kSineOne, in 2^doublings / 256 of the phases' unit
  int8_t doublings;            ///< at most 2; chosen so that the gain's highest bit is set
  uint32_t psi12;              ///< minus kHalfStep
  uint32_t psi13;              ///< minus kHalfStep
  uint32_t threshold[kChamberCount];  ///< duties d_i: positive beyond this phase; 1 is 2^32 - 1
};

/// Converts the parameters of a valid set.
Gait gait_of(const ParameterSet& set);

}  // namespace bifa
