// Timing of one chamber's valves, and the patterns that the pins can have.
#include <unity.h>

#include "../suite.h"
#include "sequencer.h"
#include "supply.h"
#include "valve_pattern.h"

using bifa::ChamberState;
using bifa::ChamberStates;
using bifa::kDeadTime_ms;
using bifa::kDwell_ms;
using bifa::ValvePattern;
using bifa::ValveSequencer;

namespace {

const ChamberState kOff = ChamberState::kOff;
const ChamberState kVacuum = ChamberState::kVacuum;
const ChamberState kPositive = ChamberState::kPositive;

bool both_on(ValvePattern pattern) { return pattern.bits() & pattern.bits() >> 1 & 0x15; }

/// Ticks until the sequencer is in `state`; at most 255.
uint8_t ticks_until(ValveSequencer& sequencer, ChamberState wanted, ChamberState state) {
  for (uint8_t ticks = 1; ticks < 255; ++ticks) {
    if (sequencer.tick(wanted) == state) return ticks;
  }
  return 255;
}

// A pattern is made from one state per chamber: there are 27, each with different pins, and none with both valves on.
void test_every_pattern_that_can_be_made_has_at_most_one_valve_of_a_chamber_on() {
  const ChamberState states[] = {kOff, kVacuum, kPositive};
  for (ChamberState body : states) {
    for (ChamberState head : states) {
      for (ChamberState tail : states) {
        const ChamberStates chosen = {{body, head, tail}};
        const ValvePattern pattern(chosen);
        TEST_ASSERT_FALSE(both_on(pattern));
        TEST_ASSERT_EQUAL_UINT8(body == kPositive, pattern.bits() & 1);
        TEST_ASSERT_EQUAL_UINT8(body == kVacuum, pattern.bits() >> 1 & 1);
        TEST_ASSERT_EQUAL_UINT8(head == kPositive, pattern.bits() >> 2 & 1);
        TEST_ASSERT_EQUAL_UINT8(head == kVacuum, pattern.bits() >> 3 & 1);
        TEST_ASSERT_EQUAL_UINT8(tail == kPositive, pattern.bits() >> 4 & 1);
        TEST_ASSERT_EQUAL_UINT8(tail == kVacuum, pattern.bits() >> 5 & 1);
      }
    }
  }
}

void test_numbers_that_are_no_state_mean_off() {
  for (uint16_t number = 3; number < 256; ++number) {
    const ChamberState forced = static_cast<ChamberState>(number);
    const ChamberStates states = {{forced, forced, forced}};
    TEST_ASSERT_EQUAL_UINT8(0, ValvePattern(states).bits());
  }
}

void test_times_are_those_that_the_valve_needs() {
  TEST_ASSERT_EQUAL_UINT8(3, kDeadTime_ms);
  TEST_ASSERT_EQUAL_UINT8(20, kDwell_ms);
}

void test_venting_a_valve_that_has_rested_does_not_delay_it() {
  ValveSequencer sequencer;
  sequencer.vent();
  TEST_ASSERT_TRUE(sequencer.tick(kPositive) == kPositive);
}

void test_a_valve_that_has_rested_opens_at_once() {
  ValveSequencer sequencer;
  TEST_ASSERT_TRUE(sequencer.tick(kPositive) == kPositive);
}

void test_one_valve_closes_before_the_other_opens() {
  ValveSequencer sequencer;
  sequencer.tick(kPositive);
  for (uint8_t i = 0; i <= kDwell_ms; ++i) sequencer.tick(kPositive);
  TEST_ASSERT_TRUE(sequencer.tick(kVacuum) == kOff);
  // Ticks are a millisecond apart to within a few microseconds: one more than the dead time guarantees the dead time.
  TEST_ASSERT_EQUAL_UINT8(kDeadTime_ms + 1, ticks_until(sequencer, kVacuum, kVacuum));
}

void test_a_valve_stays_on_for_the_dwell_however_short_its_command() {
  ValveSequencer sequencer;
  sequencer.tick(kPositive);
  TEST_ASSERT_EQUAL_UINT8(kDwell_ms + 1, ticks_until(sequencer, kVacuum, kOff));
}

void test_a_command_that_returns_within_the_dwell_is_not_seen() {
  ValveSequencer sequencer;
  sequencer.tick(kPositive);
  for (uint8_t i = 0; i + 1 < kDwell_ms; ++i)
    TEST_ASSERT_TRUE(sequencer.tick(i % 2 ? kPositive : kVacuum) == kPositive);
}

void test_venting_does_not_wait_for_the_dwell() {
  ValveSequencer sequencer;
  sequencer.tick(kPositive);
  TEST_ASSERT_TRUE(sequencer.tick(kOff) == kOff);
  sequencer = ValveSequencer();
  sequencer.tick(kVacuum);
  sequencer.vent();
  TEST_ASSERT_TRUE(sequencer.state() == kOff);
}

void test_after_a_vent_between_two_ticks_the_dead_time_is_still_whole() {
  ValveSequencer sequencer;
  sequencer.tick(kVacuum);
  sequencer.vent();  // the next tick may come at once
  TEST_ASSERT_EQUAL_UINT8(kDeadTime_ms + 1, ticks_until(sequencer, kPositive, kPositive));
}

void test_random_commands_never_break_dead_time_or_dwell() {
  ValveSequencer sequencer;
  uint32_t random = 12345;
  ChamberState last = kOff, wanted = kOff, last_driven = kOff;
  uint16_t since_change = 1000;
  uint16_t driven = 0;
  for (uint32_t tick = 0; tick < 60000; ++tick) {
    random = random * 1664525UL + 1013904223UL;
    const uint8_t dice = random >> 24;
    if (dice < 30) wanted = static_cast<ChamberState>(dice % 3);
    bool vented = wanted == kOff;
    if (dice == 255) {
      sequencer.vent();
      vented = true;
    }
    const ChamberState now = sequencer.tick(wanted);
    if (since_change < 60000) ++since_change;
    if (now == last) continue;
    if (last != kOff && now != kOff && now != last) TEST_FAIL_MESSAGE("from one valve to the other without a break");
    if (now != kOff && last == kOff) {
      if (last_driven != kOff) TEST_ASSERT_TRUE(since_change >= kDeadTime_ms);
      last_driven = now;
      ++driven;
    }
    if (now == kOff && last != kOff && !vented) TEST_ASSERT_TRUE(since_change >= kDwell_ms);
    since_change = 0;
    last = now;
  }
  TEST_ASSERT_TRUE(driven > 500);
}

// ---- the set-point, which must not be constructible above its limit either ----

void test_no_number_makes_a_set_point_above_14_psi() {
  const uint16_t kCountOf14Psi = 441;
  uint16_t greatest = 0;
  for (uint32_t pressure_mpsi = 0; pressure_mpsi < 0x20000UL; pressure_mpsi += 7) {
    const uint16_t counts = bifa::SupplyCode::of(pressure_mpsi).counts();
    if (counts > greatest) greatest = counts;
  }
  TEST_ASSERT_EQUAL_UINT16(kCountOf14Psi, greatest);
  TEST_ASSERT_EQUAL_UINT16(kCountOf14Psi, bifa::SupplyCode::of(0xFFFFFFFFUL).counts());
  TEST_ASSERT_EQUAL_UINT16(kCountOf14Psi, bifa::SupplyCode::of(14001).counts());
  TEST_ASSERT_EQUAL_UINT16(0, bifa::SupplyCode().counts());
}

void test_every_set_point_is_its_count_of_the_dac_rounded_down() {
  for (uint32_t pressure_mpsi = 0; pressure_mpsi <= 14000; ++pressure_mpsi) {
    TEST_ASSERT_EQUAL_UINT16(pressure_mpsi * 4096UL / 130000UL, bifa::SupplyCode::of(pressure_mpsi).counts());
  }
}

void test_the_paper_s_pressure_is_count_268_less_rounding() {
  TEST_ASSERT_UINT16_WITHIN(1, 268, bifa::SupplyCode::of(8500).counts());
}

void run() {
  RUN_TEST(test_every_pattern_that_can_be_made_has_at_most_one_valve_of_a_chamber_on);
  RUN_TEST(test_numbers_that_are_no_state_mean_off);
  RUN_TEST(test_times_are_those_that_the_valve_needs);
  RUN_TEST(test_venting_a_valve_that_has_rested_does_not_delay_it);
  RUN_TEST(test_a_valve_that_has_rested_opens_at_once);
  RUN_TEST(test_one_valve_closes_before_the_other_opens);
  RUN_TEST(test_a_valve_stays_on_for_the_dwell_however_short_its_command);
  RUN_TEST(test_a_command_that_returns_within_the_dwell_is_not_seen);
  RUN_TEST(test_venting_does_not_wait_for_the_dwell);
  RUN_TEST(test_after_a_vent_between_two_ticks_the_dead_time_is_still_whole);
  RUN_TEST(test_random_commands_never_break_dead_time_or_dwell);
  RUN_TEST(test_no_number_makes_a_set_point_above_14_psi);
  RUN_TEST(test_every_set_point_is_its_count_of_the_dac_rounded_down);
  RUN_TEST(test_the_paper_s_pressure_is_count_268_less_rounding);
}

}  // namespace

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
