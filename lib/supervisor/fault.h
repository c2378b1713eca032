// The faults, and the report that is kept of one.
#pragma once

#include <stdint.h>

#include "chamber.h"

namespace bifa {

enum class Fault : uint8_t {
  kNone,
  kOverPressure,   ///< value: pressure, limit: the trip (mpsi)
  kSensorRange,    ///< value: pressure, limit: end of the sensor's range (mpsi); broken wire, or saturated
  kSensorStuck,    ///< value: pressure (mpsi), limit: 2000 ms without a change, or 1000 mpsi: open input
  kRegulator,      ///< value: the regulator's monitor, limit: the set-point (mpsi)
  kSupplyControl,  ///< the DAC does not answer; value: consecutive failures, limit: how many are tolerated
  kHostSilent,     ///< value: silence, limit: host_timeout_s (both in 10 ms)
  kWatchdog,       ///< the firmware hung and was restarted
  kBrownOut,       ///< the board's supply voltage dropped
  kRestart,        ///< one of the preceding two; the bootloader hides which
};

const uint8_t kNoChannel = 3;

/// The first fault, latched until it is cleared; later faults do not overwrite it.
struct FaultReport {
  Fault fault;
  uint8_t channel;  ///< number of the chamber, or kNoChannel
  int16_t value;
  int16_t limit;
  uint32_t time_ms;                    ///< since start
  int16_t lowest_mpsi[kChamberCount];  ///< during the second before
  int16_t highest_mpsi[kChamberCount];
};

}  // namespace bifa
