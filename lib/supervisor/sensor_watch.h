// Fault detection for one pressure channel.
#pragma once

#include "chamber.h"
#include "constants.h"
#include "fault.h"
#include "persistence.h"

namespace bifa {

/// Over-pressure: this far above the set-point, for this long. Shorter times add up, and decay four times as slowly.
const int16_t kTripMargin_mpsi = 2000;
const uint16_t kTripTime_ms = 200;
const uint8_t kTripStep = 4;
/// The sensor's range ends at 15 psi; with a higher trip, over-pressure could not be told from saturation.
const int16_t kGreatestTrip_mpsi = 14800;
/// After the set-point is lowered, the trip falls no faster than the air can escape.
const int16_t kTripFall_mpsi_per_sample = 20;

/// Out of range: for this long; shorter times add up, and decay four times as slowly.
const uint16_t kRangeTime_ms = 50;
const uint8_t kRangeStep = 4;
/// Stuck: a valve has switched, and for this long, however often it switches again, not one bit of the reading has
/// changed.
const uint16_t kStuckTime_ms = 2000;

/// Open input: a reading that rises by more than this in one sample and falls in the next, or the reverse, does not
/// follow air. A valve may cause two reversals. Three per tenth of a second, for about a second, are too many.
const int16_t kJump_mpsi = 1000;
const uint8_t kJumpStep = 3;
const uint8_t kJumpLimit = 100;

/// The over-pressure limit, which follows the set-point.
class TripLimit {
 public:
  /// Call once per sample; `set_point_mpsi` at most 14000.
  void follow(uint16_t set_point_mpsi);
  int16_t mpsi() const { return limit_mpsi_; }

 private:
  int16_t limit_mpsi_ = 0;
};

/// Watches one sensor.
class SensorWatch {
 public:
  /// The fault that a sample shows, if any.
  struct Finding {
    Fault fault;
    int16_t limit;
  };

  /// `sum`: raw reading, `pressure_mpsi`: the same as a pressure, `chamber`: what the chamber is commanded to.
  Finding look(uint16_t sum, int16_t pressure_mpsi, int16_t trip_mpsi, ChamberState chamber);

  /// Whether the cause of a fault is present in this sample. A sample out of range rules nothing out.
  static bool stands(Fault fault, uint16_t sum, int16_t pressure_mpsi, int16_t trip_mpsi);

  /// Resets all counts.
  void reset();

 private:
  Accumulation above_;
  Accumulation jumping_;
  Accumulation out_of_range_;
  Persistence unmoved_;
  int16_t last_sum_ = 0;
  int8_t last_jump_ = 0;  ///< 1 up, -1 down
  ChamberState last_driven_ = ChamberState::kOff;
  bool switched_ = false;  ///< since the reading last moved
};

}  // namespace bifa
