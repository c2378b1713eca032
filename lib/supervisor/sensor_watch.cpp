#include "sensor_watch.h"

#include "sensor.h"

namespace bifa {

namespace {
const int16_t kJump = static_cast<int32_t>(kJump_mpsi) * kOversampling * 1024 / 37500;  ///< in sums of conversions
}

void TripLimit::follow(uint16_t set_point_mpsi) {
  const uint16_t highest = kGreatestTrip_mpsi - kTripMargin_mpsi;
  const int16_t target = static_cast<int16_t>(set_point_mpsi < highest ? set_point_mpsi : highest) + kTripMargin_mpsi;
  if (limit_mpsi_ - target > kTripFall_mpsi_per_sample) {
    limit_mpsi_ -= kTripFall_mpsi_per_sample;
  } else {
    limit_mpsi_ = target;
  }
}

SensorWatch::Finding SensorWatch::look(uint16_t sum, int16_t pressure_mpsi, int16_t trip_mpsi, ChamberState chamber) {
  const bool lost = !is_in_range(sum);
  if (out_of_range_.met(lost, kRangeStep, kRangeStep * (kRangeTime_ms / kSamplePeriod_ms))) {
    return {Fault::kSensorRange, sensor_mpsi(sum < kSensorLow ? kSensorLow : kSensorHigh)};
  }
  if (lost) return {Fault::kNone, 0};  // an out-of-range sample carries no information about the pressure
  if (above_.met(pressure_mpsi > trip_mpsi, kTripStep, kTripStep * (kTripTime_ms / kSamplePeriod_ms))) {
    return {Fault::kOverPressure, trip_mpsi};
  }

  const int16_t moved = static_cast<int16_t>(sum) - last_sum_;
  last_sum_ = static_cast<int16_t>(sum);
  const int8_t jump = moved > kJump ? 1 : moved < -kJump ? -1 : 0;
  const bool turned = jump * last_jump_ < 0;
  last_jump_ = jump;
  if (jumping_.met(turned, kJumpStep, kJumpLimit)) return {Fault::kSensorStuck, kJump_mpsi};

  if (moved != 0) switched_ = false;
  if (chamber != ChamberState::kOff && chamber != last_driven_) {
    if (last_driven_ != ChamberState::kOff) switched_ = true;
    last_driven_ = chamber;
  }
  if (unmoved_.met(moved == 0 && switched_, kStuckTime_ms / kSamplePeriod_ms)) {
    return {Fault::kSensorStuck, static_cast<int16_t>(kStuckTime_ms)};
  }
  return {Fault::kNone, 0};
}

bool SensorWatch::stands(Fault fault, uint16_t sum, int16_t pressure_mpsi, int16_t trip_mpsi) {
  if (fault != Fault::kSensorRange && fault != Fault::kOverPressure) return false;
  return !is_in_range(sum) || (fault == Fault::kOverPressure && pressure_mpsi > trip_mpsi);
}

void SensorWatch::reset() {
  above_.reset();
  jumping_.reset();
  out_of_range_.reset();
  last_driven_ = ChamberState::kOff;
  switched_ = false;
}

}  // namespace bifa
