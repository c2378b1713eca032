// Over-pressure and lost sensors: what trips, what does not, and three defects found in other pneumatic boards'
// sources.
#include <unity.h>

#include "../sensor_looks.h"
#include "../suite.h"
#include "sensor.h"
#include "sensor_watch.h"

using bifa::kTripMargin_mpsi;
using bifa::Persistence;
using bifa::TripLimit;

namespace {

const uint8_t kTripSamples = bifa::kTripTime_ms / bifa::kSamplePeriod_ms;

// ---- a watchdog flag that is never cleared: two short spikes far apart must not add up ----

void test_two_short_spikes_a_minute_apart_do_not_trip() {
  SensorWatch watch;
  TEST_ASSERT_TRUE(look(watch, kTrip_mpsi + 1) == Fault::kNone);
  for (uint16_t sample = 0; sample < 5900; ++sample) TEST_ASSERT_TRUE(look(watch, 0) == Fault::kNone);
  for (uint8_t sample = 1; sample < kTripSamples; ++sample) {
    TEST_ASSERT_TRUE(look(watch, kTrip_mpsi + 1) == Fault::kNone);
  }
  TEST_ASSERT_TRUE(look(watch, 0) == Fault::kNone);
}

void test_over_pressure_trips_after_exactly_its_time_and_not_before() {
  SensorWatch watch;
  for (uint8_t sample = 1; sample < kTripSamples; ++sample) {
    TEST_ASSERT_TRUE(look(watch, kTrip_mpsi + 1) == Fault::kNone);
  }
  TEST_ASSERT_TRUE(look(watch, kTrip_mpsi + 1) == Fault::kOverPressure);
}

/// Samples above the limit that it takes to trip after `above` such samples and then `below` others.
uint8_t samples_to_trip(uint8_t above, uint8_t below) {
  SensorWatch watch;
  for (; above > 0; --above) look(watch, kTrip_mpsi + 1);
  for (; below > 0; --below) look(watch, 0);
  uint8_t samples = 1;
  while (samples < 100 && look(watch, kTrip_mpsi + 1) == Fault::kNone) ++samples;
  return samples;
}

void test_over_pressure_is_forgotten_in_four_times_as_long() {
  TEST_ASSERT_EQUAL_UINT8(20, samples_to_trip(0, 0));
  TEST_ASSERT_EQUAL_UINT8(10, samples_to_trip(10, 0));
  TEST_ASSERT_EQUAL_UINT8(18, samples_to_trip(10, 30));
  TEST_ASSERT_EQUAL_UINT8(19, samples_to_trip(10, 36));
  TEST_ASSERT_EQUAL_UINT8(20, samples_to_trip(10, 37));
  TEST_ASSERT_EQUAL_UINT8(20, samples_to_trip(10, 200));
}

void test_a_watch_that_is_reset_has_forgotten_over_pressure_and_lost_samples() {
  SensorWatch above, lost;
  samples_of(above, kTripSamples - 1, kTrip_mpsi + 1, kHalfScale);
  above.reset();
  TEST_ASSERT_TRUE(samples_of(above, kTripSamples - 1, kTrip_mpsi + 1, kHalfScale) == Fault::kNone);
  samples_of(lost, 4, 0, 0);
  lost.reset();
  TEST_ASSERT_TRUE(samples_of(lost, 4, 0, 0) == Fault::kNone);
}

void test_a_pressure_at_the_limit_is_not_above_it() {
  SensorWatch watch;
  for (uint8_t sample = 0; sample < 250; ++sample) TEST_ASSERT_TRUE(look(watch, kTrip_mpsi) == Fault::kNone);
}

// 300 * 1000 overflows a 16-bit int: no time here is computed that way, and none exceeds its counter.
void test_times_are_counted_in_samples_that_fit_their_counter() {
  TEST_ASSERT_TRUE(bifa::kTripTime_ms / bifa::kSamplePeriod_ms == 20);
  TEST_ASSERT_TRUE(bifa::kRangeTime_ms / bifa::kSamplePeriod_ms == 5);
  TEST_ASSERT_TRUE(bifa::kStuckTime_ms / bifa::kSamplePeriod_ms == 200);
  Persistence persistence;
  for (uint8_t times = 1; times < 250; ++times) TEST_ASSERT_FALSE(persistence.met(true, 250));
  for (uint16_t times = 0; times < 1000; ++times) TEST_ASSERT_TRUE(persistence.met(true, 250));
}

// ---- a lost sensor that reads as low pressure: inflating until p < pmax would burst the chamber ----

void test_a_sensor_that_is_lost_is_a_fault_though_it_reads_far_below_the_limit() {
  SensorWatch watch;
  const uint16_t broken_wire = 3 * bifa::kOversampling;
  Fault fault = Fault::kNone;
  for (uint8_t sample = 0; sample < bifa::kRangeTime_ms / bifa::kSamplePeriod_ms; ++sample) {
    TEST_ASSERT_TRUE(fault == Fault::kNone);
    fault = look(watch, bifa::sensor_mpsi(broken_wire), broken_wire);
  }
  TEST_ASSERT_TRUE(fault == Fault::kSensorRange);
}

void test_a_saturated_sensor_is_a_sensor_fault() {
  SensorWatch watch;
  const uint16_t rail = 1023 * bifa::kOversampling;
  Fault fault = Fault::kNone;
  for (uint8_t sample = 0; sample < 10; ++sample) fault = look(watch, bifa::sensor_mpsi(rail), rail);
  TEST_ASSERT_TRUE(fault == Fault::kSensorRange);
}

// ---- a loose plug: a sample out of range carries no information about the pressure ----

const uint16_t kUnplugged = 0;

void test_a_loose_plug_is_found_though_every_fifth_sample_is_good() {
  SensorWatch watch;
  Fault fault = Fault::kNone;
  for (uint8_t sample = 0; sample < 10 && fault == Fault::kNone; ++sample) {
    const uint16_t sum = sample % 5 == 4 ? kHalfScale : kUnplugged;
    fault = look(watch, bifa::sensor_mpsi(sum), sum);
  }
  TEST_ASSERT_TRUE(fault == Fault::kSensorRange);
}

/// Samples out of range that it takes to fault after 4 such samples and then `good` good ones.
uint8_t lost_to_fault(uint8_t good) {
  SensorWatch watch;
  samples_of(watch, 4, 0, kUnplugged);
  samples_of(watch, good, 0, kHalfScale);
  uint8_t samples = 1;
  while (samples < 100 && look(watch, 0, kUnplugged) == Fault::kNone) ++samples;
  return samples;
}

void test_lost_samples_are_forgotten_in_four_times_as_long() {
  TEST_ASSERT_EQUAL_UINT8(1, lost_to_fault(0));
  TEST_ASSERT_EQUAL_UINT8(3, lost_to_fault(8));
  TEST_ASSERT_EQUAL_UINT8(5, lost_to_fault(14));
  TEST_ASSERT_EQUAL_UINT8(5, lost_to_fault(100));
}

void test_a_sample_out_of_range_now_and_then_is_borne() {
  SensorWatch watch;
  for (uint16_t sample = 0; sample < 1000; ++sample) {
    const uint16_t sum = sample % 5 == 4 ? kUnplugged : kHalfScale + sample % 2;
    TEST_ASSERT_TRUE(look(watch, bifa::sensor_mpsi(sum), sum) == Fault::kNone);
  }
}

void test_over_pressure_is_found_through_a_loose_plug() {
  SensorWatch watch;
  Fault fault = Fault::kNone;
  uint8_t samples = 0;
  for (; samples < 100 && fault == Fault::kNone; ++samples) {
    const bool lost = samples % 5 == 4;
    fault = look(watch, lost ? bifa::sensor_mpsi(kUnplugged) : kTrip_mpsi + 1, lost ? kUnplugged : kHalfScale);
  }
  TEST_ASSERT_TRUE(fault == Fault::kOverPressure);
  TEST_ASSERT_EQUAL_UINT8(kTripSamples + kTripSamples / 4 - 1, samples);
}

void test_a_sample_out_of_range_is_no_sign_that_over_pressure_is_over() {
  TEST_ASSERT_TRUE(SensorWatch::stands(Fault::kOverPressure, kUnplugged, -18732, kTrip_mpsi));
  TEST_ASSERT_TRUE(SensorWatch::stands(Fault::kOverPressure, kHalfScale, kTrip_mpsi + 1, kTrip_mpsi));
  TEST_ASSERT_FALSE(SensorWatch::stands(Fault::kOverPressure, kHalfScale, kTrip_mpsi, kTrip_mpsi));
  TEST_ASSERT_TRUE(SensorWatch::stands(Fault::kSensorRange, kUnplugged, -18732, kTrip_mpsi));
  TEST_ASSERT_FALSE(SensorWatch::stands(Fault::kSensorRange, kHalfScale, kTrip_mpsi + 1, kTrip_mpsi));
  TEST_ASSERT_FALSE(SensorWatch::stands(Fault::kSensorStuck, kUnplugged, kTrip_mpsi + 1, kTrip_mpsi));
}

void test_a_stuck_sensor_is_found_through_a_loose_plug() {
  SensorWatch watch;
  look(watch, 0, kHalfScale, kVacuum);
  Fault fault = Fault::kNone;
  uint16_t samples = 0;
  for (; samples < 1000 && fault == Fault::kNone; ++samples) {
    const uint16_t sum = samples % 6 == 5 ? kUnplugged : kHalfScale;
    fault = look(watch, 0, sum, kPositive);
  }
  TEST_ASSERT_TRUE(fault == Fault::kSensorStuck);
  TEST_ASSERT_UINT16_WITHIN(2, bifa::kStuckTime_ms / bifa::kSamplePeriod_ms * 6 / 5, samples);
}

void test_a_range_fault_names_the_end_of_the_range_that_was_passed() {
  SensorWatch low, high;
  for (uint8_t sample = 0; sample < 4; ++sample) {
    TEST_ASSERT_EQUAL_INT16(0, low.look(0, 0, kTrip_mpsi, kOff).limit);
    high.look(8184, 0, kTrip_mpsi, kOff);
  }
  TEST_ASSERT_EQUAL_INT16(bifa::sensor_mpsi(26 * 8), low.look(0, 0, kTrip_mpsi, kOff).limit);
  TEST_ASSERT_EQUAL_INT16(bifa::sensor_mpsi(997 * 8), high.look(8184, 0, kTrip_mpsi, kOff).limit);
}

// ---- a limit of NaN disables a trip: here there are only integers, and every one of them is a valid limit ----

void test_whatever_the_set_point_there_is_a_limit_within_the_sensor_s_range() {
  for (uint32_t set_point = 0; set_point < 0x10000UL; set_point += 13) {
    TripLimit limit;
    limit.follow(static_cast<uint16_t>(set_point));
    TEST_ASSERT_TRUE(limit.mpsi() >= kTripMargin_mpsi - bifa::kTripFall_mpsi_per_sample);
    TEST_ASSERT_TRUE(limit.mpsi() <= bifa::kGreatestTrip_mpsi);
  }
}

void test_trip_follows_a_raised_set_point_at_once_and_a_lowered_one_as_air_leaves() {
  TripLimit limit;
  limit.follow(8500);
  TEST_ASSERT_EQUAL_INT16(8500 + kTripMargin_mpsi, limit.mpsi());
  limit.follow(4500);
  TEST_ASSERT_EQUAL_INT16(8480 + kTripMargin_mpsi, limit.mpsi());
  for (uint8_t sample = 0; sample < 200; ++sample) limit.follow(4500);
  TEST_ASSERT_EQUAL_INT16(6500, limit.mpsi());
  limit.follow(14000);
  TEST_ASSERT_EQUAL_INT16(14800, limit.mpsi());  // the sensor ends at 15 psi
  limit.follow(12780);
  TEST_ASSERT_EQUAL_INT16(14780, limit.mpsi());
  limit.follow(12759);
  TEST_ASSERT_EQUAL_INT16(14760, limit.mpsi());  // 2 psi/s
}

void run() {
  RUN_TEST(test_two_short_spikes_a_minute_apart_do_not_trip);
  RUN_TEST(test_over_pressure_trips_after_exactly_its_time_and_not_before);
  RUN_TEST(test_over_pressure_is_forgotten_in_four_times_as_long);
  RUN_TEST(test_a_watch_that_is_reset_has_forgotten_over_pressure_and_lost_samples);
  RUN_TEST(test_a_pressure_at_the_limit_is_not_above_it);
  RUN_TEST(test_times_are_counted_in_samples_that_fit_their_counter);
  RUN_TEST(test_a_sensor_that_is_lost_is_a_fault_though_it_reads_far_below_the_limit);
  RUN_TEST(test_a_saturated_sensor_is_a_sensor_fault);
  RUN_TEST(test_a_loose_plug_is_found_though_every_fifth_sample_is_good);
  RUN_TEST(test_lost_samples_are_forgotten_in_four_times_as_long);
  RUN_TEST(test_a_sample_out_of_range_now_and_then_is_borne);
  RUN_TEST(test_over_pressure_is_found_through_a_loose_plug);
  RUN_TEST(test_a_sample_out_of_range_is_no_sign_that_over_pressure_is_over);
  RUN_TEST(test_a_stuck_sensor_is_found_through_a_loose_plug);
  RUN_TEST(test_a_range_fault_names_the_end_of_the_range_that_was_passed);
  RUN_TEST(test_whatever_the_set_point_there_is_a_limit_within_the_sensor_s_range);
  RUN_TEST(test_trip_follows_a_raised_set_point_at_once_and_a_lowered_one_as_air_leaves);
}

}  // namespace

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
