#pragma once

#include "chamber.h"
#include "state.h"

namespace bifa {

/// One of the 100 samples a second. All values refer to the rising edge of the strobe, except the pressures, which are
/// means over the 2.5 ms after it.
struct Sample {
  uint16_t sequence;
  uint32_t time_us;  ///< of the strobe's rising edge; wraps after 71.6 minutes
  State state;
  int16_t pressure_mpsi[kChamberCount];
  uint16_t phase[kChamberCount];        ///< turns / 65536
  ChamberState command[kChamberCount];  ///< commanded state of the chamber
  uint8_t valves;                       ///< actual state of the valves: bits of ValvePattern
};

}  // namespace bifa
