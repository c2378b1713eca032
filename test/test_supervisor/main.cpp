// The states, the valves in each, and the contents of a fault report.
#include <unity.h>

#include "../suite.h"
#include "supervisor.h"

using bifa::Chamber;
using bifa::ChamberState;
using bifa::Fault;
using bifa::FaultReport;
using bifa::LastSecond;
using bifa::State;
using bifa::Supervisor;

namespace {

const ChamberState kOff = ChamberState::kOff;
const ChamberState kVacuum = ChamberState::kVacuum;
const ChamberState kPositive = ChamberState::kPositive;

uint8_t pins = 0;  ///< levels of the valves' pins
uint8_t writes = 0;
uint8_t outdated = 0;  ///< how often waiting commands were marked as older than a stop or fault

// ---- the states ----

void tick(Supervisor& supervisor, uint8_t times) {
  for (; times > 0; --times) supervisor.tick();
}

void test_walking_puts_the_oscillators_outputs_on_the_valves() {
  Supervisor supervisor;
  supervisor.run();
  supervisor.walk(0x5);  // body and tail positive, head vacuum
  supervisor.tick();
  TEST_ASSERT_EQUAL_HEX8(0x19, pins);
}

void test_outputs_of_the_oscillators_are_nothing_unless_running() {
  Supervisor supervisor;
  supervisor.walk(0x7);
  tick(supervisor, 50);
  TEST_ASSERT_EQUAL_HEX8(0, pins);
  supervisor.hold(Chamber::kBody, kVacuum);
  supervisor.walk(0x7);
  tick(supervisor, 50);
  TEST_ASSERT_EQUAL_HEX8(0x02, pins);
}

void test_holding_ends_when_the_last_chamber_is_let_go() {
  Supervisor supervisor;
  supervisor.hold(Chamber::kHead, kPositive);
  supervisor.hold(Chamber::kTail, kVacuum);
  TEST_ASSERT_TRUE(supervisor.state() == State::kHolding);
  supervisor.hold(Chamber::kHead, kOff);
  TEST_ASSERT_TRUE(supervisor.state() == State::kHolding);
  supervisor.hold(Chamber::kTail, kOff);
  TEST_ASSERT_TRUE(supervisor.state() == State::kIdle);
}

void test_a_stop_vents_before_it_returns_from_every_state() {
  for (uint8_t way = 0; way < 3; ++way) {
    Supervisor supervisor;
    if (way == 1) supervisor.run();
    if (way == 2) supervisor.hold(Chamber::kBody, kPositive);
    supervisor.walk(0x7);
    tick(supervisor, 5);
    supervisor.stop();
    TEST_ASSERT_EQUAL_HEX8(0, pins);
    TEST_ASSERT_TRUE(supervisor.state() == State::kStopped);
    tick(supervisor, 50);
    TEST_ASSERT_EQUAL_HEX8(0, pins);
  }
}

void test_stopped_nothing_moves_until_it_is_cleared() {
  Supervisor supervisor;
  supervisor.stop();
  supervisor.run();
  supervisor.hold(Chamber::kBody, kPositive);
  supervisor.walk(0x7);
  tick(supervisor, 50);
  TEST_ASSERT_EQUAL_HEX8(0, pins);
  supervisor.clear();
  TEST_ASSERT_TRUE(supervisor.state() == State::kIdle);
  supervisor.run();
  TEST_ASSERT_TRUE(supervisor.state() == State::kRunning);
}

void test_a_fault_keeps_its_first_cause_with_channel_value_limit_time_and_extremes() {
  Supervisor supervisor;
  LastSecond last_second;
  const int16_t pressures[] = {100, 12345, -200};
  last_second.add(pressures);
  supervisor.run();
  supervisor.trip(Fault::kOverPressure, 1, 12345, 10500, 777, last_second);
  supervisor.trip(Fault::kHostSilent, bifa::kNoChannel, 1, 2, 888, last_second);
  supervisor.stop();
  const FaultReport& report = supervisor.fault();
  TEST_ASSERT_TRUE(supervisor.state() == State::kFault);
  TEST_ASSERT_TRUE(report.fault == Fault::kOverPressure);
  TEST_ASSERT_EQUAL_UINT8(1, report.channel);
  TEST_ASSERT_EQUAL_INT16(12345, report.value);
  TEST_ASSERT_EQUAL_INT16(10500, report.limit);
  TEST_ASSERT_EQUAL_UINT32(777, report.time_ms);
  TEST_ASSERT_EQUAL_INT16(12345, report.highest_mpsi[1]);
  TEST_ASSERT_EQUAL_INT16(-200, report.lowest_mpsi[2]);
  supervisor.clear();
  TEST_ASSERT_TRUE(supervisor.fault().fault == Fault::kNone);
}

void test_every_stop_and_every_new_fault_outdates_what_came_before_it() {
  Supervisor supervisor;
  LastSecond last_second;
  TEST_ASSERT_FALSE(supervisor.outdated());
  supervisor.stop();
  supervisor.stop();
  TEST_ASSERT_EQUAL_UINT8(2, outdated);
  supervisor.hear_from_now_on();
  TEST_ASSERT_FALSE(supervisor.outdated());
  supervisor.trip(Fault::kOverPressure, 1, 12345, 10500, 777, last_second);
  TEST_ASSERT_EQUAL_UINT8(3, outdated);
  TEST_ASSERT_TRUE(supervisor.outdated());
  supervisor.hear_from_now_on();
  supervisor.trip(Fault::kOverPressure, 1, 12345, 10500, 787, last_second);
  TEST_ASSERT_EQUAL_UINT8(3, outdated);
  TEST_ASSERT_FALSE(supervisor.outdated());
}

void test_each_chamber_is_walked_by_its_own_output() {
  for (uint8_t outputs = 0; outputs < 8; ++outputs) {
    Supervisor supervisor;
    supervisor.run();
    supervisor.walk(outputs);
    supervisor.tick();
    for (uint8_t i = 0; i < 3; ++i) {
      const bool positive = outputs >> i & 1;
      TEST_ASSERT_TRUE(supervisor.wanted(i) == (positive ? kPositive : kVacuum));
      TEST_ASSERT_EQUAL_HEX8(positive ? 1 : 2, pins >> 2 * i & 3);
    }
    TEST_ASSERT_EQUAL_HEX8(pins, supervisor.valves().bits());
  }
}

void test_run_is_for_idle_and_idle_for_what_moves_air() {
  Supervisor supervisor;
  supervisor.hold(Chamber::kBody, kPositive);
  TEST_ASSERT_TRUE(supervisor.moves_air());
  supervisor.run();
  TEST_ASSERT_TRUE(supervisor.state() == State::kHolding);
  supervisor.tick();
  supervisor.idle();
  TEST_ASSERT_EQUAL_HEX8(0, pins);
  TEST_ASSERT_TRUE(supervisor.state() == State::kIdle);
  TEST_ASSERT_FALSE(supervisor.moves_air());
  supervisor.run();
  TEST_ASSERT_TRUE(supervisor.moves_air());
  supervisor.hold(Chamber::kBody, kPositive);
  TEST_ASSERT_TRUE(supervisor.state() == State::kRunning);
  TEST_ASSERT_TRUE(supervisor.wanted(0) == kOff);
  supervisor.stop();
  TEST_ASSERT_FALSE(supervisor.moves_air());
  TEST_ASSERT_TRUE(supervisor.is_latched());
  supervisor.idle();
  TEST_ASSERT_TRUE(supervisor.state() == State::kStopped);
}

void test_a_vent_ends_what_every_chamber_was_to_do() {
  for (uint8_t chamber = 0; chamber < 3; ++chamber) {
    for (uint8_t way = 0; way < 4; ++way) {
      Supervisor supervisor;
      LastSecond last_second;
      supervisor.hold(static_cast<Chamber>(chamber), kPositive);
      supervisor.tick();
      if (way == 0) supervisor.idle();
      if (way == 1) supervisor.stop();
      if (way == 2) supervisor.trip(Fault::kOverPressure, chamber, 1, 2, 3, last_second);
      if (way == 3) supervisor.hold(static_cast<Chamber>(chamber), kOff);
      TEST_ASSERT_EQUAL_HEX8(0, pins);
      TEST_ASSERT_EQUAL_HEX8(0, supervisor.valves().bits());
      TEST_ASSERT_TRUE(supervisor.wanted(chamber) == kOff);
      tick(supervisor, 10);
      TEST_ASSERT_EQUAL_HEX8(0, pins);
      // the valve has had its time to close
      if (way == 1 || way == 2) supervisor.clear();
      supervisor.hold(static_cast<Chamber>(chamber), kVacuum);
      tick(supervisor, 1);
      TEST_ASSERT_EQUAL_HEX8(2 << 2 * chamber, pins);
    }
  }
}

void test_a_second_fault_vents_but_keeps_the_first_one_s_report() {
  Supervisor supervisor;
  LastSecond last_second;
  supervisor.trip(Fault::kOverPressure, 1, 12345, 10500, 777, last_second);
  pins = 0xFF;  // arbitrary pin levels
  supervisor.trip(Fault::kHostSilent, bifa::kNoChannel, 1, 2, 888, last_second);
  TEST_ASSERT_EQUAL_HEX8(0, pins);
  TEST_ASSERT_TRUE(supervisor.fault().fault == Fault::kOverPressure);
  TEST_ASSERT_TRUE(supervisor.is_latched());
}

void test_pins_are_written_only_when_they_change() {
  Supervisor supervisor;
  supervisor.hold(Chamber::kBody, kPositive);
  tick(supervisor, 3);
  TEST_ASSERT_EQUAL_UINT8(1, writes);
}

void run() {
  RUN_TEST(test_walking_puts_the_oscillators_outputs_on_the_valves);
  RUN_TEST(test_outputs_of_the_oscillators_are_nothing_unless_running);
  RUN_TEST(test_holding_ends_when_the_last_chamber_is_let_go);
  RUN_TEST(test_a_stop_vents_before_it_returns_from_every_state);
  RUN_TEST(test_stopped_nothing_moves_until_it_is_cleared);
  RUN_TEST(test_a_fault_keeps_its_first_cause_with_channel_value_limit_time_and_extremes);
  RUN_TEST(test_every_stop_and_every_new_fault_outdates_what_came_before_it);
  RUN_TEST(test_each_chamber_is_walked_by_its_own_output);
  RUN_TEST(test_run_is_for_idle_and_idle_for_what_moves_air);
  RUN_TEST(test_a_vent_ends_what_every_chamber_was_to_do);
  RUN_TEST(test_a_second_fault_vents_but_keeps_the_first_one_s_report);
  RUN_TEST(test_pins_are_written_only_when_they_change);
}

}  // namespace

void bifa::set_valves(ValvePattern pattern) {
  pins = pattern.bits();
  ++writes;
}
void bifa::outdate_input() { ++outdated; }

void setUp() { pins = writes = outdated = 0; }
void tearDown() {}

RUN_SUITE(run)
