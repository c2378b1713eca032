// From conversions to pressure: Honeywell ABPDRRV015PDAA5, ratiometric, and the regulator's monitor.
#pragma once

#include "chamber.h"

namespace bifa {

/// Conversions summed for one sample of a sensor.
const uint8_t kOversampling = 8;

/// The converter's results for one sample: 10 bits each, relative to the supply that also feeds the sensors.
struct RawRound {
  uint16_t sum[kChamberCount];  ///< of kOversampling conversions
  uint16_t monitor;             ///< one conversion of the regulator's monitor
};

/// Pressure from the sum of kOversampling conversions: 0.1 to 0.9 of the supply is -15 to 15 psi. Returns -18732 to
/// 18732.
int16_t sensor_mpsi(uint16_t sum);

/// Pressure from one conversion of the monitor: 1 to 5 V is 0 to 130 psi; clamped to int16_t.
int16_t monitor_mpsi(uint16_t conversion);

/// Outside 2.5 to 97.5 % of the supply, a sensor is broken, disconnected, or far beyond its range.
const uint16_t kSensorLow = 26 * kOversampling;
const uint16_t kSensorHigh = 997 * kOversampling;
inline bool is_in_range(uint16_t sum) { return sum >= kSensorLow && sum <= kSensorHigh; }

/// Below this the monitor is not connected (its zero is 1 V, count 205), since A3 is then tied to ground.
const uint16_t kMonitorAbsent = 150;

}  // namespace bifa
