// The positive supply: a DAC that answers or does not, and the regulator's monitor.
#include <unity.h>

#include "../suite.h"
#include "sensor.h"
#include "supply_watch.h"

using bifa::RegulatorWatch;

namespace {

/// The monitor's conversion of `volts` on a board whose own supply is `supply_V`.
uint16_t conversion(double volts, double supply_V = 5) {
  const double exact = volts / supply_V * 1024;
  return exact > 1023 ? 1023 : static_cast<uint16_t>(exact);
}
double monitor_V(double pressure_psi) { return 1 + pressure_psi * 4 / 130; }

/// Whether the watch finds a deviation within `samples` identical samples.
bool finds(RegulatorWatch& watch, uint16_t samples, uint16_t conversion, uint16_t set_point_mpsi) {
  bool found = false;
  for (; samples > 0; --samples) found = watch.look(conversion, set_point_mpsi) || found;
  return found;
}

void test_two_failures_of_the_dac_are_borne_and_the_third_in_a_row_is_not() {
  bifa::DacWatch dac;
  TEST_ASSERT_FALSE(dac.failed());
  dac.told(false);
  dac.told(false);
  TEST_ASSERT_FALSE(dac.failed());
  dac.told(true);
  dac.told(false);
  dac.told(false);
  TEST_ASSERT_FALSE(dac.failed());
  dac.told(false);
  TEST_ASSERT_TRUE(dac.failed());
  dac.told(true);
  TEST_ASSERT_FALSE(dac.failed());
}

void test_a_monitor_that_is_not_connected_is_not_believed() {
  RegulatorWatch watch;
  TEST_ASSERT_FALSE(watch.deviates());
  TEST_ASSERT_FALSE(finds(watch, 2000, 0, 8500));
  TEST_ASSERT_FALSE(finds(watch, 2000, 149, 8500));
  TEST_ASSERT_FALSE(watch.deviates());
}

void test_a_monitor_is_connected_once_it_has_shown_its_zero_for_a_second() {
  RegulatorWatch watch;
  TEST_ASSERT_FALSE(finds(watch, 99, 150, 14000));
  TEST_ASSERT_FALSE(finds(watch, 1, 149, 14000));
  TEST_ASSERT_FALSE(finds(watch, 99, 150, 14000));
  TEST_ASSERT_FALSE(watch.deviates());
  finds(watch, 1, 150, 14000);
  TEST_ASSERT_TRUE(watch.deviates());
  TEST_ASSERT_TRUE(finds(watch, 300, 0, 14000));  // and remains so if its wire comes off
}

void test_a_regulator_that_does_not_follow_is_found_in_two_and_a_half_seconds() {
  const uint16_t at_zero = conversion(monitor_V(0)), at_set_point = conversion(monitor_V(8.5));
  RegulatorWatch watch;
  TEST_ASSERT_FALSE(finds(watch, 200, at_zero, 0));
  TEST_ASSERT_FALSE(finds(watch, 249, at_zero, 8500));
  TEST_ASSERT_FALSE(finds(watch, 249, at_set_point, 8500));
  TEST_ASSERT_FALSE(finds(watch, 249, at_zero, 8500));
  TEST_ASSERT_TRUE(finds(watch, 1, at_zero, 8500));
}

void test_a_regulator_that_deviates_now_and_then_is_found_if_that_is_most_of_the_time() {
  RegulatorWatch watch;
  finds(watch, 200, conversion(monitor_V(0)), 0);
  bool found = false;
  for (uint8_t turn = 0; turn < 80 && !found; ++turn) {
    found = finds(watch, 8, conversion(monitor_V(20)), 8500);
    finds(watch, 2, conversion(monitor_V(8.5)), 8500);
  }
  TEST_ASSERT_TRUE(found);
}

void test_a_watch_that_is_reset_begins_to_count_anew() {
  RegulatorWatch watch;
  finds(watch, 200, conversion(monitor_V(0)), 0);
  finds(watch, 249, conversion(monitor_V(20)), 8500);
  watch.reset();
  TEST_ASSERT_FALSE(finds(watch, 249, conversion(monitor_V(20)), 8500));
  TEST_ASSERT_TRUE(finds(watch, 1, conversion(monitor_V(20)), 8500));
}

/// Readings as far from the set-point as is tolerated.
void test_six_point_seven_psi_above_and_four_point_six_below_are_borne() {
  for (uint16_t set_point = 0; set_point <= 14000; set_point += 7000) {
    for (uint16_t conversion = 150; conversion < 400; ++conversion) {
      RegulatorWatch watch;
      finds(watch, 100, conversion, set_point);
      const int32_t deviation = static_cast<int32_t>(bifa::monitor_mpsi(conversion)) - set_point;
      TEST_ASSERT_EQUAL(deviation > 6700 || deviation < -4600, watch.deviates());
    }
  }
  RegulatorWatch exactly;
  const int16_t reading = bifa::monitor_mpsi(300);
  finds(exactly, 100, 300, reading - 6700);
  TEST_ASSERT_FALSE(exactly.deviates());
  finds(exactly, 1, 300, reading - 6701);
  TEST_ASSERT_TRUE(exactly.deviates());
  finds(exactly, 1, 300, reading + 4600);
  TEST_ASSERT_FALSE(exactly.deviates());
  finds(exactly, 1, 300, reading + 4601);
  TEST_ASSERT_TRUE(exactly.deviates());
}

// The DAC follows the board's supply, the monitor does not.
void test_no_supply_that_the_board_works_on_is_taken_for_a_regulator_that_does_not_follow() {
  for (double supply_V = 4.5; supply_V < 5.26; supply_V += 0.05) {
    for (uint16_t set_point = 0; set_point <= 14000; set_point += 3500) {
      const double pressure_psi = set_point / 1000.0 * supply_V / 5;
      for (double off_psi = -1.3; off_psi < 1.4; off_psi += 1.3) {  // the regulator's own 1 %
        RegulatorWatch watch;
        TEST_ASSERT_FALSE(finds(watch, 400, conversion(monitor_V(pressure_psi + off_psi), supply_V), set_point));
      }
    }
  }
}

void run() {
  RUN_TEST(test_two_failures_of_the_dac_are_borne_and_the_third_in_a_row_is_not);
  RUN_TEST(test_a_monitor_that_is_not_connected_is_not_believed);
  RUN_TEST(test_a_monitor_is_connected_once_it_has_shown_its_zero_for_a_second);
  RUN_TEST(test_a_regulator_that_does_not_follow_is_found_in_two_and_a_half_seconds);
  RUN_TEST(test_a_regulator_that_deviates_now_and_then_is_found_if_that_is_most_of_the_time);
  RUN_TEST(test_a_watch_that_is_reset_begins_to_count_anew);
  RUN_TEST(test_six_point_seven_psi_above_and_four_point_six_below_are_borne);
  RUN_TEST(test_no_supply_that_the_board_works_on_is_taken_for_a_regulator_that_does_not_follow);
}

}  // namespace

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
