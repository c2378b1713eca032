#pragma once

#include "chamber.h"
#include "state.h"

namespace bifa {

/// One of the 100 samples a second. Everything in it belongs to the rising edge of the strobe; the pressures are means
/// over the 2.5 ms that follow it.
struct Sample {
  uint16_t sequence;
  uint32_t time_us;  ///< of the strobe's rising edge; wraps after 71.6 minutes
  State state;
  int16_t pressure_mpsi[kChamberCount];
  uint16_t phase[kChamberCount];        ///< turns / 65536
  ChamberState command[kChamberCount];  ///< what the chamber is to do
  uint8_t valves;                       ///< what its valves do: bits of ValvePattern
};

}  // namespace bifa
