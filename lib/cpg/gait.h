// A gait in the units of the integer CPG: phases in turns / 2^32, steps of 1 ms.
#pragma once

#include "chamber.h"
#include "parameter_table.h"

namespace bifa {

/// The oscillators look at the upper 16 bits of an error; half of the last of these, added, rounds.
const uint32_t kHalfStep = 0x8000;

struct Gait {
  uint32_t increment;          ///< of every phase a step: 2^32 f / 1000
  uint8_t increment_fraction;  ///< and 1/256 of that unit: the period is within 0.06 ppm
  uint16_t gain;               ///< what a sine of 1 / kSineOne adds in a step, in 2^doublings / 256 of the phases' unit
  int8_t doublings;            ///< 2 or less; so that the gain's highest bit is set
  uint32_t psi12;              ///< less kHalfStep
  uint32_t psi13;              ///< less kHalfStep
  uint32_t threshold[kChamberCount];  ///< duties d_i: positive beyond this phase; 1 is 2^32 - 1
};

/// Converts the parameters of a valid set.
Gait gait_of(const ParameterSet& set);

}  // namespace bifa
