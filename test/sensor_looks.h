// Shared by the suites of SensorWatch: sequences of samples.
#pragma once

#include "sensor.h"
#include "sensor_watch.h"

namespace {

using bifa::ChamberState;
using bifa::Fault;
using bifa::SensorWatch;

const ChamberState kOff = ChamberState::kOff;
const ChamberState kVacuum = ChamberState::kVacuum;
const ChamberState kPositive = ChamberState::kPositive;
const uint16_t kHalfScale = 512 * bifa::kOversampling;
const int16_t kTrip_mpsi = 10000;

Fault look(SensorWatch& watch, int16_t pressure_mpsi, uint16_t sum = kHalfScale, ChamberState chamber = kOff) {
  return watch.look(sum, pressure_mpsi, kTrip_mpsi, chamber).fault;
}

/// The first fault in `samples` identical samples.
Fault samples_of(SensorWatch& watch, uint16_t samples, int16_t pressure_mpsi, uint16_t sum,
                 ChamberState chamber = kOff) {
  Fault fault = Fault::kNone;
  for (; samples > 0 && fault == Fault::kNone; --samples) fault = look(watch, pressure_mpsi, sum, chamber);
  return fault;
}

}  // namespace
