// The positive supply: the DAC that answers or does not, the regulator's monitor.
#include <unity.h>

#include "../suite.h"
#include "supply_watch.h"

namespace {

// ---- the supply ----

void test_two_failures_of_the_dac_are_borne_and_the_third_in_a_row_is_not() {
  bifa::DacWatch dac;
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

// 300 * 1000 wraps in a 16-bit int.
void test_time_of_the_monitor_is_counted_in_samples_that_fit_their_counter() {
  TEST_ASSERT_TRUE(bifa::kMonitorTime_ms / 10 == 250);
}

void test_a_monitor_that_is_not_connected_is_not_believed() {
  bifa::RegulatorWatch regulator;
  for (uint16_t sample = 0; sample < 2000; ++sample) TEST_ASSERT_FALSE(regulator.look(0, 8500));
}

void test_a_regulator_that_does_not_follow_is_found_and_one_that_takes_two_seconds_is_not() {
  const uint16_t at_zero = 205, at_set_point = 258;
  bifa::RegulatorWatch regulator;
  for (uint16_t sample = 0; sample < 200; ++sample) TEST_ASSERT_FALSE(regulator.look(at_zero, 0));
  for (uint16_t sample = 0; sample < 200; ++sample) TEST_ASSERT_FALSE(regulator.look(at_zero, 8500));
  for (uint16_t sample = 0; sample < 200; ++sample) TEST_ASSERT_FALSE(regulator.look(at_set_point, 8500));
  bool found = false;
  for (uint16_t sample = 0; sample < 260; ++sample) found = regulator.look(at_zero, 8500);
  TEST_ASSERT_TRUE(found);
}

void run() {
  RUN_TEST(test_two_failures_of_the_dac_are_borne_and_the_third_in_a_row_is_not);
  RUN_TEST(test_time_of_the_monitor_is_counted_in_samples_that_fit_their_counter);
  RUN_TEST(test_a_monitor_that_is_not_connected_is_not_believed);
  RUN_TEST(test_a_regulator_that_does_not_follow_is_found_and_one_that_takes_two_seconds_is_not);
}

}  // namespace

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
