// A gait in the units of the integer CPG: phases in turns / 2^32, steps of 1 ms.
#pragma once

#include "chamber.h"
#include "parameter_table.h"

namespace bifa {

struct Gait {
  uint32_t increment;          ///< of every phase a step: 2^32 f / 1000
  uint8_t increment_fraction;  ///< and 1/256 of that unit, which keeps the period within 0.03 ppm
  uint16_t gain;               ///< what a sine of 1 / kSineOne adds in a step, in 1/64 of the phases' unit
  uint32_t psi12;
  uint32_t psi13;
  uint32_t threshold[kChamberCount];   ///< duties d_i: positive from this phase on
  bool never_positive[kChamberCount];  ///< d_i = 1 has no threshold within 32 bits
};

/// Converts the parameters of a valid set.
Gait gait_of(const ParameterSet& set);

}  // namespace bifa
