// Conversions to pressures, and the extremes of the last second.
#include <unity.h>

#include "../suite.h"
#include "calibration.h"
#include "extremes.h"
#include "rest.h"
#include "sensor.h"

using bifa::kOversampling;
using bifa::LastSecond;
using bifa::sensor_mpsi;

namespace {

void test_sensor_spans_15_psi_either_way_from_10_to_90_percent_of_the_supply() {
  // Half a step is added to every conversion: a converter rounds down.
  TEST_ASSERT_INT16_WITHIN(20, 0, sensor_mpsi(512 * kOversampling));
  TEST_ASSERT_INT16_WITHIN(20, -15000, sensor_mpsi(static_cast<uint16_t>(102.4 * kOversampling)));
  TEST_ASSERT_INT16_WITHIN(20, 15000, sensor_mpsi(static_cast<uint16_t>(921.6 * kOversampling)));
}

void test_every_sum_of_conversions_gives_a_pressure_and_more_volts_more_of_it() {
  int16_t last = sensor_mpsi(0);
  TEST_ASSERT_INT16_WITHIN(1, -18732, last);
  for (uint16_t sum = 1; sum <= 1023 * kOversampling; ++sum) {
    const int16_t pressure = sensor_mpsi(sum);
    TEST_ASSERT_INT16_WITHIN(3, last + 4, pressure);  // 4.58 mpsi a step
    last = pressure;
  }
  TEST_ASSERT_INT16_WITHIN(1, 18731, last);
}

#ifndef __AVR__  // where double has 24 bits
// Compared with the formulas in the datasheets, in floating point.
void test_pressures_are_the_nearest_thousandths_of_a_psi() {
  for (uint16_t sum = 0; sum <= 1023 * 8; ++sum) {
    const double exact = (sum / 8.0 + 0.5) * 37500 / 1024 - 18750;
    TEST_ASSERT_TRUE(sensor_mpsi(sum) - exact <= 0.5 && exact - sensor_mpsi(sum) < 0.5);
  }
  for (uint16_t conversion = 0; conversion < 410; ++conversion) {
    const double exact = (5 * (conversion + 0.5) / 1024 - 1) * 130000 / 4;
    TEST_ASSERT_TRUE(bifa::monitor_mpsi(conversion) <= exact + 0.01 && bifa::monitor_mpsi(conversion) > exact - 1);
  }
  TEST_ASSERT_EQUAL_INT16(INT16_MAX, bifa::monitor_mpsi(412));
}
#endif

void test_range_of_a_sensor_that_works_is_its_diagnostic_band() {
  TEST_ASSERT_FALSE(bifa::is_in_range(0));
  TEST_ASSERT_FALSE(bifa::is_in_range(26 * 8 - 1));
  TEST_ASSERT_TRUE(bifa::is_in_range(26 * 8));
  TEST_ASSERT_TRUE(bifa::is_in_range(997 * 8));
  TEST_ASSERT_FALSE(bifa::is_in_range(997 * 8 + 1));
  TEST_ASSERT_FALSE(bifa::is_in_range(1023 * kOversampling));
}

void test_monitor_of_the_regulator_is_0_to_130_psi_at_1_to_5_volts() {
  TEST_ASSERT_INT16_WITHIN(160, 0, bifa::monitor_mpsi(205));
  TEST_ASSERT_INT16_WITHIN(160, 8500, bifa::monitor_mpsi(258));
  TEST_ASSERT_EQUAL_INT16(INT16_MAX, bifa::monitor_mpsi(1023));
  TEST_ASSERT_INT16_WITHIN(160, -32420, bifa::monitor_mpsi(0));
}

void test_zero_offsets_beyond_the_sensor_s_error_band_are_no_offsets() {
  const bifa::Calibration good = {{900, -900, 0}};
  const bifa::Calibration high = {{0, 901, 0}};
  const bifa::Calibration low = {{0, 0, -901}};
  TEST_ASSERT_TRUE(bifa::is_valid(good));
  TEST_ASSERT_FALSE(bifa::is_valid(high));
  TEST_ASSERT_FALSE(bifa::is_valid(low));
  const bifa::Calibration first = {{901, 0, 0}};
  TEST_ASSERT_FALSE(bifa::is_valid(first));
}

void add(LastSecond& last, int16_t pressure, uint16_t samples) {
  const int16_t pressures[] = {pressure, static_cast<int16_t>(-pressure), 0};
  for (; samples > 0; --samples) last.add(pressures);
}

void test_last_second_remembers_a_single_sample_for_a_second_and_forgets_it_soon_after() {
  LastSecond last;
  add(last, 100, 200);
  add(last, 5000, 1);
  add(last, 100, 99);
  TEST_ASSERT_EQUAL_INT16(5000, last.highest_mpsi(0));
  TEST_ASSERT_EQUAL_INT16(-5000, last.lowest_mpsi(1));
  TEST_ASSERT_EQUAL_INT16(0, last.highest_mpsi(2));
  add(last, 100, 40);
  TEST_ASSERT_EQUAL_INT16(100, last.highest_mpsi(0));
  TEST_ASSERT_EQUAL_INT16(-100, last.lowest_mpsi(1));
}

// ---- steady pressures, for taking a zero ----

void add(bifa::Rest& rest, int16_t pressure, uint16_t samples) {
  const int16_t pressures[] = {pressure, static_cast<int16_t>(-pressure), 0};
  for (; samples > 0; --samples) rest.add(pressures);
}

void test_pressures_rest_once_their_means_have_stayed_for_four_seconds() {
  bifa::Rest rest;
  add(rest, 40, 399);
  TEST_ASSERT_FALSE(rest.is_long());
  add(rest, 40, 1);
  TEST_ASSERT_TRUE(rest.is_long());
  TEST_ASSERT_EQUAL_INT16(40, rest.mean_mpsi(0));
  TEST_ASSERT_INT16_WITHIN(1, -40, rest.mean_mpsi(1));
  TEST_ASSERT_EQUAL_INT16(0, rest.mean_mpsi(2));
  add(rest, 500, 10);
  TEST_ASSERT_FALSE(rest.is_long());
}

void test_a_mean_that_moves_by_more_than_a_count_begins_its_rest_anew() {
  bifa::Rest rest;
  add(rest, 41, 400);
  TEST_ASSERT_FALSE(rest.is_long());
  // Follow the slow mean until it passes 40.
  int32_t sum = 0;
  uint16_t samples = 0;
  for (; sum / 32 <= 40; ++samples) sum += 50 - sum / 32;
  bifa::Rest moved;
  const int16_t pressures[] = {50, 0, 0};
  for (uint16_t n = 0; n < samples + 400; ++n) moved.add(pressures);
  TEST_ASSERT_FALSE(moved.is_long());
  moved.add(pressures);
  TEST_ASSERT_TRUE(moved.is_long());
}

void test_a_mean_is_rounded() {
  bifa::Rest rest;
  const int16_t pressures[] = {16, 15, -17};
  rest.add(pressures);
  TEST_ASSERT_EQUAL_INT16(1, rest.mean_mpsi(0));
  TEST_ASSERT_EQUAL_INT16(0, rest.mean_mpsi(1));
  TEST_ASSERT_EQUAL_INT16(-1, rest.mean_mpsi(2));
}

// The difference does not fit 16 bits: on the chip, the mean used to move the wrong way.
void test_a_jump_from_rail_to_rail_moves_the_mean_towards_where_it_went() {
  const int32_t rail = 18731;
  bifa::Rest rest;
  add(rest, static_cast<int16_t>(-rail), 2000);
  const int16_t before[] = {rest.mean_mpsi(0), rest.mean_mpsi(1)};
  TEST_ASSERT_INT16_WITHIN(2, -rail, before[0]);
  TEST_ASSERT_INT16_WITHIN(2, rail, before[1]);
  add(rest, rail, 1);
  TEST_ASSERT_INT16_WITHIN(2, before[0] + 2 * rail / 32, rest.mean_mpsi(0));
  TEST_ASSERT_INT16_WITHIN(2, before[1] - 2 * rail / 32, rest.mean_mpsi(1));
  add(rest, rail, 2000);
  TEST_ASSERT_INT16_WITHIN(2, rail, rest.mean_mpsi(0));
  TEST_ASSERT_TRUE(rest.is_long());
}

// Compared with a complete record: the samples of the last three parts and of the current one.
void test_last_second_holds_the_last_three_thirds_and_the_one_under_way() {
  LastSecond last;
  for (int16_t n = 0; n < 9 * 34 + 7; ++n) {
    const int16_t pressures[] = {static_cast<int16_t>(100 + n), static_cast<int16_t>(-100 - n), 7};
    last.add(pressures);
    const int16_t part = n / 34, first = part > 3 ? (part - 3) * 34 : 0;
    TEST_ASSERT_EQUAL_INT16(100 + first, last.lowest_mpsi(0));
    TEST_ASSERT_EQUAL_INT16(100 + n, last.highest_mpsi(0));
    TEST_ASSERT_EQUAL_INT16(-100 - n, last.lowest_mpsi(1));
    TEST_ASSERT_EQUAL_INT16(-100 - first, last.highest_mpsi(1));
    TEST_ASSERT_EQUAL_INT16(7, last.lowest_mpsi(2));
    TEST_ASSERT_EQUAL_INT16(7, last.highest_mpsi(2));
  }
}

void test_last_second_knows_nothing_before_the_first_sample() {
  LastSecond last;
  TEST_ASSERT_EQUAL_INT16(0, last.lowest_mpsi(0));
  TEST_ASSERT_EQUAL_INT16(0, last.highest_mpsi(0));
}

void run() {
  RUN_TEST(test_sensor_spans_15_psi_either_way_from_10_to_90_percent_of_the_supply);
  RUN_TEST(test_every_sum_of_conversions_gives_a_pressure_and_more_volts_more_of_it);
#ifndef __AVR__
  RUN_TEST(test_pressures_are_the_nearest_thousandths_of_a_psi);
#endif
  RUN_TEST(test_range_of_a_sensor_that_works_is_its_diagnostic_band);
  RUN_TEST(test_monitor_of_the_regulator_is_0_to_130_psi_at_1_to_5_volts);
  RUN_TEST(test_zero_offsets_beyond_the_sensor_s_error_band_are_no_offsets);
  RUN_TEST(test_last_second_remembers_a_single_sample_for_a_second_and_forgets_it_soon_after);
  RUN_TEST(test_pressures_rest_once_their_means_have_stayed_for_four_seconds);
  RUN_TEST(test_a_mean_that_moves_by_more_than_a_count_begins_its_rest_anew);
  RUN_TEST(test_a_mean_is_rounded);
  RUN_TEST(test_a_jump_from_rail_to_rail_moves_the_mean_towards_where_it_went);
  RUN_TEST(test_last_second_holds_the_last_three_thirds_and_the_one_under_way);
  RUN_TEST(test_last_second_knows_nothing_before_the_first_sample);
}

}  // namespace

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
