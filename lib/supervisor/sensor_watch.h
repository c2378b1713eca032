// What one pressure channel must not do.
#pragma once

#include "chamber.h"
#include "constants.h"
#include "fault.h"
#include "persistence.h"

namespace bifa {

/// Over-pressure: so far above the set-point, for so long. Shorter times add up, and are forgotten in four times as long.
const int16_t kTripMargin_mpsi = 2000;
const uint16_t kTripTime_ms = 200;
const uint8_t kTripStep = 4;
/// The sensor's range ends at 15 psi: from here on it could not tell over-pressure from itself.
const int16_t kGreatestTrip_mpsi = 14800;
/// After the set-point is lowered the trip follows it no faster than air can leave.
const int16_t kTripFall_mpsi_per_sample = 20;

/// Out of range: for so long; shorter times add up, and are forgotten in four times as long.
const uint16_t kRangeTime_ms = 50;
const uint8_t kRangeStep = 4;
/// A valve has switched and for so long, however often it switches again, not the least bit of the reading has moved.
const uint16_t kStuckTime_ms = 2000;

/// A reading that goes up by more than this in one sample and down in the next, or down and up, follows no air: an open
/// input. A valve may make it turn twice. Three a tenth of a second, for a second or so, are too many.
const int16_t kJump_mpsi = 1000;
const uint8_t kJumpStep = 3;
const uint8_t kJumpLimit = 100;

/// The limit of over-pressure, which follows the set-point.
class TripLimit {
 public:
  /// Once a sample; `set_point_mpsi` at most 14000.
  void follow(uint16_t set_point_mpsi);
  int16_t mpsi() const { return limit_mpsi_; }

 private:
  int16_t limit_mpsi_ = 0;
};

/// Watches one sensor.
class SensorWatch {
 public:
  /// What a sample shows.
  struct Finding {
    Fault fault;
    int16_t limit;
  };

  /// `sum`: raw, `pressure_mpsi`: what it means, `chamber`: what its valves do.
  Finding look(uint16_t sum, int16_t pressure_mpsi, int16_t trip_mpsi, ChamberState chamber);

  /// Whether the cause of a fault is there in this very sample, as far as it can tell: one out of range denies nothing.
  static bool stands(Fault fault, uint16_t sum, int16_t pressure_mpsi, int16_t trip_mpsi);

  /// Forgets what was counted.
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
