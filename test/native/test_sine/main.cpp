// The table and its interpolation against the C library's sine.
#include <math.h>
#include <unity.h>

#include "../../suite.h"
#include "sine.h"

namespace {

double exact(uint32_t angle) { return bifa::kSineOne * sin(angle / 65536.0 * 2 * M_PI); }

void test_every_entry_of_the_table_is_the_rounded_sine() {
  for (int i = 0; i <= bifa::kSineSteps + 1; ++i) {
    TEST_ASSERT_EQUAL_INT(lround(bifa::kSineOne * sin(M_PI / 2 * i / bifa::kSineSteps)), bifa::kSineTable[i]);
  }
}

void test_steps_between_entries_fit_the_eight_bits_that_the_interpolation_multiplies() {
  for (int i = 0; i < bifa::kSineSteps; ++i) {
    TEST_ASSERT_TRUE(bifa::kSineTable[i + 1] - bifa::kSineTable[i] <= 255);
  }
}

void test_every_angle_is_within_two_units() {
  double greatest = 0;
  for (uint32_t angle = 0; angle < 65536; ++angle) {
    greatest = fmax(greatest, fabs(bifa::sine(static_cast<uint16_t>(angle)) - exact(angle)));
  }
  TEST_ASSERT_TRUE(greatest <= 2);
}

void test_sine_is_exactly_odd_and_two_of_them_fit_sixteen_bits_with_room_to_extrapolate() {
  for (uint32_t angle = 0; angle < 65536; ++angle) {
    const int16_t value = bifa::sine(static_cast<uint16_t>(angle));
    TEST_ASSERT_EQUAL_INT16(-value, bifa::sine(static_cast<uint16_t>(-angle)));
    TEST_ASSERT_TRUE(2 * value <= 32767 * 0.98);
  }
}

void run() {
  RUN_TEST(test_every_entry_of_the_table_is_the_rounded_sine);
  RUN_TEST(test_steps_between_entries_fit_the_eight_bits_that_the_interpolation_multiplies);
  RUN_TEST(test_every_angle_is_within_two_units);
  RUN_TEST(test_sine_is_exactly_odd_and_two_of_them_fit_sixteen_bits_with_room_to_extrapolate);
}

}  // namespace

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
