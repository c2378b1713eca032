// Sensors whose reading does not change, and open inputs, whose reading changes faster than air pressure can.
#include <unity.h>

#include "../sensor_looks.h"
#include "../suite.h"
#include "sensor.h"
#include "sensor_watch.h"

namespace {

// ---- a stuck sensor ----

void test_a_reading_that_does_not_move_by_a_bit_for_two_seconds_after_a_switch_is_stuck() {
  SensorWatch watch;
  look(watch, 0, kHalfScale, kVacuum);
  uint16_t samples = 0;
  while (look(watch, 0, kHalfScale, kPositive) == Fault::kNone && samples < 1000) ++samples;
  TEST_ASSERT_UINT16_WITHIN(1, bifa::kStuckTime_ms / bifa::kSamplePeriod_ms, samples + 1);
}

void test_a_reading_that_rests_is_not_stuck_while_nothing_switches() {
  SensorWatch watch;
  for (uint16_t sample = 0; sample < 1000; ++sample) {
    TEST_ASSERT_TRUE(look(watch, 0, kHalfScale, kPositive) == Fault::kNone);
  }
}

void test_a_reading_that_moved_after_the_switch_may_rest() {
  SensorWatch watch;
  look(watch, 0, kHalfScale, kVacuum);
  look(watch, 0, kHalfScale, kPositive);
  for (uint16_t sample = 0; sample < 1000; ++sample) {
    TEST_ASSERT_TRUE(look(watch, 0, kHalfScale + 1, kPositive) == Fault::kNone);
  }
}

// ---- an open input ----

/// Reversals (up, down) of `counts` after which the fault is found; 255 if it is not.
uint8_t turns_to_fault(uint16_t counts, uint8_t quiet) {
  SensorWatch watch;
  samples_of(watch, 2, 0, kHalfScale);
  for (uint8_t turns = 0; turns < 255; ++turns) {
    const uint16_t sum = turns % 2 ? kHalfScale : kHalfScale + counts;
    if (look(watch, 0, sum) != Fault::kNone) return turns;
    if (samples_of(watch, quiet, 0, sum) != Fault::kNone) return turns;
  }
  return 255;
}

void test_a_reading_that_turns_back_by_more_than_a_psi_from_sample_to_sample_is_an_open_input() {
  const uint16_t a_psi = 218;                                 // 1000 mpsi * 8 * 1024 / 37500
  TEST_ASSERT_EQUAL_UINT8(34, turns_to_fault(a_psi + 1, 0));  // 3 * 34 >= 100; the first jump is not a reversal
  TEST_ASSERT_EQUAL_UINT8(255, turns_to_fault(a_psi, 0));
  TEST_ASSERT_EQUAL_UINT8(255, turns_to_fault(a_psi + 1, 1));  // a valve, once in a while
}

/// `turns` reversals, then `calm` samples, then reversals until the fault is found; returns how many.
uint8_t turns_after(uint8_t turns, uint16_t calm) {
  SensorWatch watch;
  samples_of(watch, 2, 0, kHalfScale);
  for (uint8_t i = 0; i <= turns; ++i) look(watch, 0, i % 2 ? kHalfScale : kHalfScale + 300);
  const uint16_t at = turns % 2 ? kHalfScale : kHalfScale + 300;
  samples_of(watch, calm, 0, at);
  const uint16_t other = turns % 2 ? kHalfScale + 300 : kHalfScale;
  for (uint8_t i = 0; i < 100; ++i) {
    if (look(watch, 0, i % 2 ? at : other) != Fault::kNone) return i;
  }
  return 100;
}

/// Repeatedly up by `up` counts and down by `down`.
bool is_open_input(int16_t up, int16_t down) {
  SensorWatch watch;
  int16_t sum = kHalfScale;
  samples_of(watch, 2, 0, kHalfScale);
  for (uint8_t turn = 0; turn < 36; ++turn) {
    sum += turn % 2 ? -down : up;
    if (look(watch, 0, sum) != Fault::kNone) return true;
  }
  return false;
}

void test_both_ways_have_to_be_more_than_a_psi() {
  TEST_ASSERT_TRUE(is_open_input(219, 300));
  TEST_ASSERT_TRUE(is_open_input(300, 219));
  TEST_ASSERT_FALSE(is_open_input(218, 300));
  TEST_ASSERT_FALSE(is_open_input(300, 218));
}

void test_a_watch_that_is_reset_has_forgotten_turns_and_switches() {
  SensorWatch watch;
  samples_of(watch, 2, 0, kHalfScale);
  for (uint8_t i = 0; i < 33; ++i) look(watch, 0, i % 2 ? kHalfScale : kHalfScale + 300);
  watch.reset();
  for (uint8_t i = 0; i < 20; ++i) {
    TEST_ASSERT_TRUE(look(watch, 0, i % 2 ? kHalfScale : kHalfScale + 300) == Fault::kNone);
  }
  SensorWatch driven;
  samples_of(driven, 2, 0, kHalfScale, kVacuum);
  driven.reset();
  TEST_ASSERT_TRUE(samples_of(driven, 250, 0, kHalfScale, kPositive) == Fault::kNone);
  SensorWatch switched;
  samples_of(switched, 2, 0, kHalfScale, kVacuum);
  samples_of(switched, 150, 0, kHalfScale, kPositive);
  switched.reset();
  TEST_ASSERT_TRUE(samples_of(switched, 250, 0, kHalfScale, kPositive) == Fault::kNone);
}

void test_turns_add_up_and_are_forgotten_in_three_times_as_long() {
  TEST_ASSERT_EQUAL_UINT8(24, turns_after(20, 30));  // 60 - 30 - 1 (the jump that is no reversal) + 72 >= 100
  TEST_ASSERT_EQUAL_UINT8(34, turns_after(20, 70));
  TEST_ASSERT_EQUAL_UINT8(15, turns_after(20, 2));
  TEST_ASSERT_EQUAL_UINT8(1, turns_after(33, 1));  // 99 - 2 + 3: exactly 100
}

void test_a_stuck_sensor_and_an_open_input_name_their_limits() {
  SensorWatch stuck, open;
  stuck.look(kHalfScale, 0, kTrip_mpsi, kVacuum);
  for (uint8_t sample = 0; sample < 199; ++sample) stuck.look(kHalfScale, 0, kTrip_mpsi, kPositive);
  TEST_ASSERT_EQUAL_INT16(2000, stuck.look(kHalfScale, 0, kTrip_mpsi, kPositive).limit);
  for (uint8_t sample = 0; sample < 35; ++sample) open.look(kHalfScale + 300 * (sample % 2), 0, kTrip_mpsi, kOff);
  TEST_ASSERT_EQUAL_INT16(1000, open.look(kHalfScale + 300, 0, kTrip_mpsi, kOff).limit);
  TEST_ASSERT_EQUAL_INT16(kTrip_mpsi, SensorWatch().look(kHalfScale, 0, kTrip_mpsi, kOff).limit + kTrip_mpsi);
}

void test_a_chamber_that_was_vented_in_between_has_not_switched_unless_it_changed_supply() {
  SensorWatch watch;
  samples_of(watch, 2, 0, kHalfScale, kPositive);
  samples_of(watch, 2, 0, kHalfScale, kOff);
  TEST_ASSERT_TRUE(samples_of(watch, 250, 0, kHalfScale, kPositive) == Fault::kNone);
  samples_of(watch, 2, 0, kHalfScale, kOff);
  TEST_ASSERT_TRUE(samples_of(watch, 200, 0, kHalfScale, kVacuum) == Fault::kSensorStuck);
}

void run() {
  RUN_TEST(test_a_reading_that_does_not_move_by_a_bit_for_two_seconds_after_a_switch_is_stuck);
  RUN_TEST(test_a_reading_that_rests_is_not_stuck_while_nothing_switches);
  RUN_TEST(test_a_reading_that_moved_after_the_switch_may_rest);
  RUN_TEST(test_a_reading_that_turns_back_by_more_than_a_psi_from_sample_to_sample_is_an_open_input);
  RUN_TEST(test_both_ways_have_to_be_more_than_a_psi);
  RUN_TEST(test_a_watch_that_is_reset_has_forgotten_turns_and_switches);
  RUN_TEST(test_turns_add_up_and_are_forgotten_in_three_times_as_long);
  RUN_TEST(test_a_stuck_sensor_and_an_open_input_name_their_limits);
  RUN_TEST(test_a_chamber_that_was_vented_in_between_has_not_switched_unless_it_changed_supply);
}

}  // namespace

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
