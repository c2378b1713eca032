// Conditions that must last: consecutively, or summed.
#include <unity.h>

#include "../suite.h"
#include "persistence.h"

using bifa::Accumulation;
using bifa::Persistence;

namespace {

void test_a_condition_in_a_row_counts_once_it_has_lasted_and_as_long_as_it_lasts() {
  Persistence persistence;
  for (uint8_t turn = 0; turn < 2; ++turn) {
    TEST_ASSERT_FALSE(persistence.met(true, 3));
    TEST_ASSERT_FALSE(persistence.met(true, 3));
    for (uint16_t times = 0; times < 600; ++times) TEST_ASSERT_TRUE(persistence.met(true, 3));
    TEST_ASSERT_FALSE(persistence.met(false, 3));
  }
}

/// Consecutive times after which the condition counts as met.
uint8_t times_to_meet(Accumulation& accumulation) {
  for (uint8_t times = 1; times < 100; ++times) {
    if (accumulation.met(true, 4, 20)) return times;
  }
  return 100;
}

void test_what_adds_up_ends_with_the_first_time_that_it_is_not_met() {
  Accumulation accumulation;
  TEST_ASSERT_EQUAL_UINT8(5, times_to_meet(accumulation));
  for (uint16_t times = 0; times < 600; ++times) TEST_ASSERT_TRUE(accumulation.met(true, 4, 20));
  TEST_ASSERT_FALSE(accumulation.met(false, 4, 20));
  TEST_ASSERT_EQUAL_UINT8(1, times_to_meet(accumulation));
}

void test_what_adds_up_is_forgotten_one_at_a_time_and_never_below_nothing() {
  Accumulation accumulation;
  for (uint8_t times = 0; times < 50; ++times) TEST_ASSERT_FALSE(accumulation.met(false, 4, 20));
  TEST_ASSERT_FALSE(accumulation.met(true, 4, 20));
  TEST_ASSERT_FALSE(accumulation.met(false, 4, 20));
  TEST_ASSERT_FALSE(accumulation.met(false, 4, 20));
  TEST_ASSERT_EQUAL_UINT8(5, times_to_meet(accumulation));  // 2 + 5 * 4 >= 20
}

void test_an_accumulation_that_is_reset_begins_anew() {
  Accumulation accumulation;
  times_to_meet(accumulation);
  accumulation.reset();
  for (uint8_t times = 0; times < 3; ++times) TEST_ASSERT_FALSE(accumulation.met(true, 1, 4));
  TEST_ASSERT_TRUE(accumulation.met(true, 1, 4));
}

void run() {
  RUN_TEST(test_a_condition_in_a_row_counts_once_it_has_lasted_and_as_long_as_it_lasts);
  RUN_TEST(test_what_adds_up_ends_with_the_first_time_that_it_is_not_met);
  RUN_TEST(test_what_adds_up_is_forgotten_one_at_a_time_and_never_below_nothing);
  RUN_TEST(test_an_accumulation_that_is_reset_begins_anew);
}

}  // namespace

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
