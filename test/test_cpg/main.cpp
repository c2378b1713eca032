// Edge cases of the oscillators, and that this computer and the chip compute identical bits.
#include <unity.h>

#include "../suite.h"
#include "oscillators.h"
#include "parameters.h"

using bifa::gait_of;
using bifa::Oscillators;
using bifa::ParameterSet;

namespace {

const uint8_t kBody = 1;
const uint8_t kHead = 2;
const uint8_t kAll = 7;

uint32_t xorshift(uint32_t& state) {
  state ^= state << 13;
  state ^= state >> 17;
  state ^= state << 5;
  return state;
}

ParameterSet quick() {
  ParameterSet set = bifa::factory_preset(0);
  set.period_us = 500000;
  return set;
}

/// Collects the outputs over some steps: those that were ever on, and those that always were.
void collect(Oscillators& oscillators, uint16_t steps, uint8_t& ever, uint8_t& always) {
  ever = 0;
  always = kAll;
  for (; steps > 0; --steps) {
    oscillators.step();
    ever |= oscillators.outputs();
    always &= oscillators.outputs();
  }
}

void test_same_bits_as_everywhere_over_a_hundred_thousand_steps() {
  Oscillators oscillators;
  ParameterSet set = bifa::factory_preset(0);
  uint32_t state = 1;
  uint32_t sum = 0;
  for (uint8_t change = 0; change < 100; ++change) {
    set.period_us = 500000 + xorshift(state) % 59500001;
    set.psi12_mdeg = xorshift(state) % 360001;
    set.psi13_mdeg = xorshift(state) % 360001;
    set.coupling_milli_per_s = xorshift(state) % 20001;
    set.duty_body_e4 = xorshift(state) % 10001;
    oscillators.use(gait_of(set));
    if (change % 4 == 0) {
      const uint32_t body = xorshift(state);
      const uint32_t head = xorshift(state);
      oscillators.place(body, head, xorshift(state));
    }
    for (uint16_t step = 0; step < 1000; ++step) {
      oscillators.step();
      for (uint8_t i = 0; i < 3; ++i) sum = (sum << 5 | sum >> 27) ^ oscillators.phase(i);
      sum += oscillators.outputs();
    }
  }
  TEST_ASSERT_EQUAL_HEX32(0xFF3BA0D4UL, sum);
}

void test_a_duty_of_0_is_always_positive_and_one_of_1_never() {
  ParameterSet set = quick();
  set.duty_body_e4 = 0;
  set.duty_head_e4 = 10000;
  Oscillators oscillators;
  oscillators.use(gait_of(set));
  oscillators.settle();
  uint8_t ever, always;
  collect(oscillators, 2000, ever, always);
  TEST_ASSERT_BITS_HIGH(kBody, always);
  TEST_ASSERT_BITS_LOW(kHead, ever);
}

void test_at_the_very_ends_of_the_turn_too() {
  ParameterSet set = bifa::factory_preset(0);
  set.period_us = 60000000;
  set.duty_body_e4 = 0;
  set.duty_head_e4 = 10000;
  set.coupling_milli_per_s = 0;
  Oscillators oscillators;
  const bifa::Gait gait = gait_of(set);
  oscillators.use(gait);
  for (uint32_t phase = 0xFFFFFFF0UL; phase != 0x10; ++phase) {
    // After one step the phase that is compared, in the middle of the coming millisecond, is `phase`.
    const uint32_t before = phase - gait.increment - gait.increment / 2;
    oscillators.place(before, before, before);
    oscillators.step();
    TEST_ASSERT_BITS_HIGH(kBody, oscillators.outputs());
    TEST_ASSERT_BITS_LOW(kHead, oscillators.outputs());
  }
}

void test_psi_of_360_degrees_is_psi_of_0() {
  ParameterSet set = quick();
  set.psi12_mdeg = set.psi13_mdeg = 0;
  const bifa::Gait zero = gait_of(set);
  set.psi12_mdeg = set.psi13_mdeg = 360000;
  const bifa::Gait full = gait_of(set);
  TEST_ASSERT_EQUAL_HEX32(zero.psi12, full.psi12);
  TEST_ASSERT_EQUAL_HEX32(zero.psi13, full.psi13);
}

void test_settled_each_chamber_switches_exactly_twice_a_cycle() {
  ParameterSet set = quick();
  set.duty_body_e4 = 6535;
  set.duty_head_e4 = 4390;
  set.duty_tail_e4 = 50;
  Oscillators oscillators;
  oscillators.use(gait_of(set));
  oscillators.settle();
  oscillators.step();
  uint8_t switches[3] = {0, 0, 0};
  uint8_t last = oscillators.outputs();
  for (uint16_t step = 0; step < 10 * 500; ++step) {
    oscillators.step();
    for (uint8_t i = 0; i < 3; ++i) switches[i] += (last ^ oscillators.outputs()) >> i & 1;
    last = oscillators.outputs();
  }
  for (uint8_t i = 0; i < 3; ++i) TEST_ASSERT_EQUAL_UINT8(20, switches[i]);
}

void test_phases_settle_to_psi_ahead_of_the_body_and_wrap() {
  ParameterSet set = quick();
  set.psi12_mdeg = 204500;
  set.psi13_mdeg = 331700;
  Oscillators oscillators;
  oscillators.use(gait_of(set));
  oscillators.place(0xFFFFFF00UL, 0x10, 0x80000000UL);
  for (uint16_t step = 0; step < 5000; ++step) oscillators.step();
  const uint16_t head = static_cast<uint16_t>((oscillators.phase(1) - oscillators.phase(0)) >> 16);
  const uint16_t tail = static_cast<uint16_t>((oscillators.phase(2) - oscillators.phase(0)) >> 16);
  TEST_ASSERT_UINT16_WITHIN(1, 37228, head);  // 204.5 / 360 * 65536
  TEST_ASSERT_UINT16_WITHIN(1, 60384, tail);
}

void test_running_starts_with_the_body_at_phase_0_and_settled() {
  Oscillators oscillators;
  oscillators.use(gait_of(bifa::factory_preset(0)));
  oscillators.place(123, 456, 789);
  oscillators.settle();
  TEST_ASSERT_EQUAL_HEX32(0, oscillators.phase(0));
  TEST_ASSERT_EQUAL_HEX32(0xC0000000UL, oscillators.phase(1));
  TEST_ASSERT_EQUAL_HEX32(0x40000000UL, oscillators.phase(2));
}

void run() {
  RUN_TEST(test_same_bits_as_everywhere_over_a_hundred_thousand_steps);
  RUN_TEST(test_a_duty_of_0_is_always_positive_and_one_of_1_never);
  RUN_TEST(test_at_the_very_ends_of_the_turn_too);
  RUN_TEST(test_psi_of_360_degrees_is_psi_of_0);
  RUN_TEST(test_settled_each_chamber_switches_exactly_twice_a_cycle);
  RUN_TEST(test_phases_settle_to_psi_ahead_of_the_body_and_wrap);
  RUN_TEST(test_running_starts_with_the_body_at_phase_0_and_settled);
}

}  // namespace

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
