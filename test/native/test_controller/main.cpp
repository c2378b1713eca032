// The facade, tick by tick: which requests are allowed when, sampling, faults and how they are released.
#include <unity.h>

#include "../../suite.h"
#include "controller.h"
#include "critical.h"
#include "parameters.h"

using bifa::Calibration;
using bifa::Chamber;
using bifa::ChamberState;
using bifa::Controller;
using bifa::Fault;
using bifa::ParameterSet;
using bifa::RawRound;
using bifa::Sample;
using bifa::StartCause;
using bifa::State;
using bifa::Verdict;

namespace {

const uint16_t kZero = 512 * bifa::kOversampling;
const uint16_t kMonitorZero = 0;
const uint8_t kBodyPositive = 0x01;
const uint8_t kBodyVacuum = 0x02;

uint8_t pins = 0;     ///< levels of the valves' pins
uint8_t ever_on = 0;  ///< pins that have ever been on

/// A controller on a board whose converter answers immediately.
struct Bench {
  Controller controller;
  RawRound round = {{kZero, kZero, kZero}, kMonitorZero};
  bool pressed = false;
  uint16_t rounds = 0;
  bool strobed = true;  ///< the strobe rose with the last round
  bool noisy = true;    ///< the readings' last bit changes, as with a working sensor

  explicit Bench(StartCause cause = StartCause::kPower, ParameterSet set = bifa::factory_preset(0)) {
    pins = ever_on = 0;
    controller.begin(cause, set, Calibration());
  }

  void tick(uint32_t times = 1) {
    for (; times > 0; --times) {
      const bool begins = controller.tick(pressed);
      if (!begins) continue;
      ++rounds;
      strobed = controller.strobes();
      RawRound seen = round;
      if (noisy && rounds % 2) ++seen.sum[0], ++seen.sum[1], ++seen.sum[2];
      controller.converted_in_interrupt(seen);
    }
  }

  /// A stop byte in the receive interrupt, which other interrupts wait for.
  void stop_byte() {
    const bifa::Critical interrupts_off;
    controller.stop_in_interrupt();
  }

  /// A `clear` that is sent now.
  Verdict clear() {
    controller.hear_from_now_on();
    return controller.clear();
  }

  State state() const { return controller.state(); }
  Fault fault() const { return controller.status().fault.fault; }
  void pressure(uint8_t chamber, uint16_t conversion) { round.sum[chamber] = conversion * bifa::kOversampling; }
};

void equal_u16(uint16_t expected, uint16_t actual) { TEST_ASSERT_EQUAL_UINT16(expected, actual); }
void equal(Verdict expected, Verdict actual) {
  TEST_ASSERT_EQUAL_UINT8(static_cast<uint8_t>(expected), static_cast<uint8_t>(actual));
}
void equal(State expected, State actual) {
  TEST_ASSERT_EQUAL_UINT8(static_cast<uint8_t>(expected), static_cast<uint8_t>(actual));
}
void equal(Fault expected, Fault actual) {
  TEST_ASSERT_EQUAL_UINT8(static_cast<uint8_t>(expected), static_cast<uint8_t>(actual));
}

// ---- which requests are allowed when ----

void test_it_starts_idle_and_vented() {
  Bench bench;
  bench.tick(100);
  equal(State::kIdle, bench.state());
  TEST_ASSERT_EQUAL_HEX8(0, pins);
}

void test_run_walks_with_the_body_at_vacuum_first() {
  Bench bench;
  equal(Verdict::kDone, bench.controller.run());
  bench.tick(10);
  equal(State::kRunning, bench.state());
  TEST_ASSERT_EQUAL_HEX8(0x02 | 0x04 | 0x20, pins);  // baseline: head 270, tail 90 degrees ahead
  equal(Verdict::kRefused, bench.controller.run());
}

void test_stop_vents_and_returns_to_idle() {
  Bench bench;
  bench.controller.run();
  bench.tick(10);
  equal(Verdict::kDone, bench.controller.stop());
  TEST_ASSERT_EQUAL_HEX8(0, pins);
  equal(State::kIdle, bench.state());
}

void test_hold_is_for_idle_and_holding_only() {
  Bench bench;
  equal(Verdict::kDone, bench.controller.hold(Chamber::kBody, ChamberState::kPositive));
  bench.tick(5);
  TEST_ASSERT_EQUAL_HEX8(kBodyPositive, pins);
  equal(Verdict::kRefused, bench.controller.run());
  bench.controller.stop();
  bench.controller.run();
  equal(Verdict::kRefused, bench.controller.hold(Chamber::kBody, ChamberState::kPositive));
}

void test_a_stop_byte_latches_until_clear() {
  Bench bench;
  bench.controller.run();
  bench.tick(10);
  bench.stop_byte();
  TEST_ASSERT_EQUAL_HEX8(0, pins);
  equal(Verdict::kLatched, bench.controller.run());
  equal(Verdict::kLatched, bench.controller.hold(Chamber::kBody, ChamberState::kVacuum));
  equal(Verdict::kLatched, bench.controller.schedule_start());
  equal(Verdict::kDone, bench.controller.stop());
  equal(State::kStopped, bench.state());
  equal(Verdict::kDone, bench.clear());
  equal(State::kIdle, bench.state());
}

void test_a_clear_that_came_before_the_stop_does_not_undo_it() {
  Bench bench;
  bench.controller.hear_from_now_on();
  bench.stop_byte();
  equal(Verdict::kLatched, bench.controller.clear());
  equal(State::kStopped, bench.state());
  equal(Verdict::kDone, bench.clear());
  bench.controller.hear_from_now_on();
  bench.pressed = true;
  bench.tick();
  bench.pressed = false;
  bench.tick();
  equal(Verdict::kLatched, bench.controller.clear());
  equal(State::kStopped, bench.state());
}

void test_a_clear_that_came_before_the_fault_does_not_undo_it() {
  Bench bench;
  bench.noisy = false;
  bench.controller.run();
  bench.controller.hear_from_now_on();
  bench.tick(5700);
  equal(Fault::kSensorStuck, bench.fault());
  equal(Verdict::kLatched, bench.controller.clear());
  bench.controller.hear_from_now_on();
  bench.tick(100);  // it is found again at every sample
  equal(Verdict::kDone, bench.controller.clear());
}

void test_emergency_stop_holds_as_long_as_it_is_pressed() {
  Bench bench;
  bench.controller.run();
  bench.tick(10);
  bench.pressed = true;
  bench.tick();
  TEST_ASSERT_EQUAL_HEX8(0, pins);
  equal(State::kStopped, bench.state());
  equal(Verdict::kCauseStands, bench.clear());
  bench.pressed = false;
  bench.tick();
  equal(State::kStopped, bench.state());
  equal(Verdict::kDone, bench.clear());
}

void test_emergency_stop_that_is_pressed_at_power_up_counts() {
  Bench bench;
  bench.pressed = true;
  bench.tick();
  equal(State::kStopped, bench.state());
}

void test_a_set_that_comes_while_running_does_not_make_the_phases_jump() {
  Bench bench;
  bench.controller.run();
  bench.tick(1000);
  Sample before, after;
  bench.controller.take_sample(before);
  ParameterSet set = bifa::factory_preset(0);
  set.period_us = 60000000;
  set.duty_body_e4 = 9000;
  bench.controller.apply(set);
  bench.tick(11);
  bench.controller.take_sample(after);
  for (uint8_t i = 0; i < 3; ++i) {
    TEST_ASSERT_UINT16_WITHIN(230, 0, static_cast<uint16_t>(after.phase[i] - before.phase[i]));  // 20 ms of 5.7 s
  }
}

// ---- timed holds ----

void test_timed_holds_come_on_their_tick() {
  Bench bench;
  Controller& controller = bench.controller;
  equal(Verdict::kDone, controller.schedule_add(0, Chamber::kBody, ChamberState::kVacuum));
  equal(Verdict::kDone, controller.schedule_add(100, Chamber::kBody, ChamberState::kOff));
  equal(Verdict::kOrder, controller.schedule_add(99, Chamber::kBody, ChamberState::kOff));
  equal(Verdict::kDone, controller.schedule_start());
  TEST_ASSERT_TRUE(controller.status().scheduled);
  equal(Verdict::kRefused, controller.schedule_add(200, Chamber::kBody, ChamberState::kOff));
  bench.tick();
  TEST_ASSERT_EQUAL_HEX8(kBodyVacuum, pins);
  bench.tick(99);
  TEST_ASSERT_EQUAL_HEX8(kBodyVacuum, pins);
  bench.tick();
  TEST_ASSERT_EQUAL_HEX8(0, pins);
  TEST_ASSERT_FALSE(controller.status().scheduled);
  equal(State::kIdle, bench.state());
}

void test_a_stop_ends_timed_holds() {
  Bench bench;
  bench.controller.schedule_add(50, Chamber::kBody, ChamberState::kPositive);
  bench.controller.schedule_start();
  bench.stop_byte();
  bench.tick(2);
  bench.clear();
  bench.tick(200);
  TEST_ASSERT_EQUAL_HEX8(0, pins);
}

void test_timed_holds_do_not_outlive_a_stop_that_is_cleared_within_a_tick() {
  Bench bench;
  bench.controller.schedule_add(50, Chamber::kBody, ChamberState::kPositive);
  bench.controller.schedule_start();
  bench.stop_byte();
  equal(Verdict::kDone, bench.clear());
  bench.tick(200);
  TEST_ASSERT_EQUAL_HEX8(0, pins);
}

void test_a_schedule_has_room_for_sixteen() {
  Bench bench;
  for (uint8_t i = 0; i < 16; ++i) {
    equal(Verdict::kDone, bench.controller.schedule_add(i, Chamber::kTail, ChamberState::kVacuum));
  }
  equal(Verdict::kFull, bench.controller.schedule_add(99, Chamber::kTail, ChamberState::kVacuum));
  equal(Verdict::kDone, bench.controller.schedule_clear());
  equal(Verdict::kDone, bench.controller.schedule_add(0, Chamber::kTail, ChamberState::kVacuum));
}

void test_nothing_walks_while_timed_holds_wait() {
  Bench bench;
  bench.controller.schedule_add(100, Chamber::kBody, ChamberState::kPositive);
  bench.controller.schedule_start();
  bench.tick(10);
  equal(State::kIdle, bench.state());
  equal(Verdict::kRefused, bench.controller.run());
  bench.tick(100);
  TEST_ASSERT_EQUAL_HEX8(kBodyPositive, pins);  // none of them was lost
}

void test_timed_holds_that_run_are_not_started_again() {
  Bench bench;
  bench.controller.schedule_add(100, Chamber::kBody, ChamberState::kPositive);
  bench.controller.schedule_start();
  bench.tick(60);
  equal(Verdict::kRefused, bench.controller.schedule_start());
  bench.tick(41);
  TEST_ASSERT_EQUAL_HEX8(kBodyPositive, pins);
  equal(Verdict::kDone, bench.controller.schedule_start());  // they have run
}

void test_clearing_timed_holds_that_run_vents_what_they_hold() {
  Bench bench;
  bench.controller.schedule_add(0, Chamber::kBody, ChamberState::kPositive);
  bench.controller.schedule_add(1000, Chamber::kBody, ChamberState::kOff);
  bench.controller.schedule_start();
  bench.tick(10);
  TEST_ASSERT_EQUAL_HEX8(kBodyPositive, pins);
  equal(Verdict::kDone, bench.controller.schedule_clear());
  TEST_ASSERT_EQUAL_HEX8(0, pins);
  equal(State::kIdle, bench.state());
}

void test_clearing_timed_holds_that_do_not_run_leaves_held_chambers_alone() {
  Bench bench;
  bench.controller.hold(Chamber::kBody, ChamberState::kVacuum);
  bench.tick(10);
  equal(Verdict::kDone, bench.controller.schedule_clear());
  TEST_ASSERT_EQUAL_HEX8(kBodyVacuum, pins);
}

void test_timed_holds_that_wait_for_longer_than_the_host_may_be_silent_open_no_valve() {
  ParameterSet set = bifa::factory_preset(0);
  set.host_timeout_ms = 500;
  Bench bench(StartCause::kPower, set);
  bench.controller.schedule_add(2000, Chamber::kBody, ChamberState::kPositive);
  bench.controller.schedule_start();
  for (uint16_t ms = 0; ms < 3000; ++ms) {
    bench.tick();
    TEST_ASSERT_EQUAL_HEX8(0, ever_on);
  }
  equal(Fault::kHostSilent, bench.fault());
}

void test_a_hold_that_falls_due_as_the_host_becomes_too_silent_opens_no_valve() {
  ParameterSet set = bifa::factory_preset(0);
  set.host_timeout_ms = 500;
  for (uint16_t due_ms = 498; due_ms < 502; ++due_ms) {
    Bench bench(StartCause::kPower, set);
    bench.controller.schedule_add(due_ms, Chamber::kBody, ChamberState::kPositive);
    bench.controller.schedule_start();
    bench.tick(499);
    const uint8_t before = pins;
    bench.tick(5);
    TEST_ASSERT_EQUAL_HEX8(before, ever_on);
    equal(Fault::kHostSilent, bench.fault());
  }
}

void test_stop_ends_timed_holds_for_good() {
  Bench bench;
  bench.controller.schedule_add(50, Chamber::kBody, ChamberState::kPositive);
  bench.controller.schedule_start();
  bench.tick(10);
  equal(Verdict::kDone, bench.controller.stop());
  TEST_ASSERT_FALSE(bench.controller.status().scheduled);
  bench.tick(200);
  TEST_ASSERT_EQUAL_HEX8(0, pins);
}

void test_a_schedule_that_is_started_again_begins_at_time_0() {
  Bench bench;
  bench.controller.schedule_add(50, Chamber::kBody, ChamberState::kPositive);
  bench.controller.schedule_add(90, Chamber::kBody, ChamberState::kOff);
  for (uint8_t turn = 0; turn < 3; ++turn) {
    equal(Verdict::kDone, bench.controller.schedule_start());
    bench.tick(50);
    TEST_ASSERT_EQUAL_HEX8(0, pins);
    bench.tick(1);
    TEST_ASSERT_EQUAL_HEX8(kBodyPositive, pins);
    bench.tick(40);
    TEST_ASSERT_EQUAL_HEX8(0, pins);
    bench.tick(30);
  }
}

void test_an_empty_schedule_does_not_run() {
  Bench bench;
  equal(Verdict::kDone, bench.controller.schedule_start());
  TEST_ASSERT_FALSE(bench.controller.status().scheduled);
  bench.controller.schedule_add(10, Chamber::kBody, ChamberState::kPositive);
  bench.controller.schedule_clear();
  equal(Verdict::kDone, bench.controller.schedule_start());
  bench.tick(100);
  TEST_ASSERT_EQUAL_HEX8(0, pins);
}

void test_timed_holds_are_not_started_while_it_walks() {
  Bench bench;
  bench.controller.schedule_add(10, Chamber::kBody, ChamberState::kPositive);
  bench.controller.run();
  equal(Verdict::kRefused, bench.controller.schedule_start());
  bench.controller.stop();
  bench.controller.hold(Chamber::kHead, ChamberState::kVacuum);
  equal(Verdict::kDone, bench.controller.schedule_start());
}

void test_every_chamber_and_state_can_be_held_at_a_time_even_at_the_same() {
  const uint8_t on[] = {0, 2, 1};
  for (uint8_t chamber = 0; chamber < 3; ++chamber) {
    for (uint8_t state = 0; state < 3; ++state) {
      Bench bench;
      const uint8_t other = (chamber + 1) % 3;
      bench.controller.schedule_add(70000, static_cast<Chamber>(other), ChamberState::kVacuum);
      bench.controller.schedule_add(70000, static_cast<Chamber>(chamber), static_cast<ChamberState>(state));
      bench.controller.schedule_start();
      bench.tick(70000);
      TEST_ASSERT_EQUAL_HEX8(0, pins);
      bench.tick();
      TEST_ASSERT_EQUAL_HEX8(on[state] << 2 * chamber | 2 << 2 * other, pins);
    }
  }
}

// ---- sampling ----

void test_a_sample_every_ten_milliseconds_stamped_with_the_strobe() {
  Bench bench;
  uint32_t last_us = 0;
  uint16_t last_sequence = 0;
  uint8_t samples = 0;
  for (uint16_t ms = 0; ms < 1000; ++ms) {
    bench.tick();
    Sample sample;
    if (!bench.controller.take_sample(sample)) continue;
    if (samples > 0) {
      TEST_ASSERT_EQUAL_UINT32(10000, sample.time_us - last_us);
      TEST_ASSERT_EQUAL_UINT16(1, static_cast<uint16_t>(sample.sequence - last_sequence));
    }
    last_us = sample.time_us;
    last_sequence = sample.sequence;
    ++samples;
  }
  TEST_ASSERT_UINT16_WITHIN(1, 100, samples);
  TEST_ASSERT_UINT16_WITHIN(1, 100, bench.rounds);
  TEST_ASSERT_EQUAL_UINT16(0, bench.controller.status().samples_lost);
}

void test_a_sample_says_what_stood_at_its_strobe() {
  Bench bench;
  bench.pressure(0, 500);
  bench.pressure(1, 520);
  bench.pressure(2, 560);
  bench.tick(40);
  bench.controller.hold(Chamber::kHead, ChamberState::kPositive);
  bench.controller.hold(Chamber::kTail, ChamberState::kVacuum);
  bench.tick(20);
  Sample sample;
  TEST_ASSERT_TRUE(bench.controller.take_sample(sample));
  TEST_ASSERT_FALSE(bench.controller.take_sample(sample));
  equal(State::kHolding, sample.state);
  TEST_ASSERT_EQUAL_HEX8(0x04 | 0x20, sample.valves);
  const ChamberState commands[] = {ChamberState::kOff, ChamberState::kPositive, ChamberState::kVacuum};
  const uint16_t conversions[] = {500, 520, 560};
  for (uint8_t i = 0; i < 3; ++i) {
    TEST_ASSERT_TRUE(commands[i] == sample.command[i]);
    TEST_ASSERT_INT16_WITHIN(5, bifa::sensor_mpsi(conversions[i] * 8), sample.pressure_mpsi[i]);
  }
  // Changes during the conversion appear in the next sample.
  for (uint8_t ms = 0; ms < 10; ++ms) bench.controller.tick(false);
  bench.controller.stop();
  bench.controller.converted_in_interrupt(bench.round);
  TEST_ASSERT_FALSE(bench.controller.take_sample(sample));
  bench.controller.tick(false);
  TEST_ASSERT_TRUE(bench.controller.take_sample(sample));
  equal(State::kHolding, sample.state);
  TEST_ASSERT_EQUAL_HEX8(0x04 | 0x20, sample.valves);
  TEST_ASSERT_TRUE(sample.command[1] == ChamberState::kPositive);
  bench.tick(19);
  TEST_ASSERT_TRUE(bench.controller.take_sample(sample));
  equal(State::kIdle, sample.state);
  TEST_ASSERT_EQUAL_HEX8(0, sample.valves);
}

void test_phases_of_a_sample_are_turns_of_65536_and_every_walk_begins_with_the_body_at_0() {
  Bench bench;
  for (uint8_t walk = 0; walk < 2; ++walk) {
    bench.controller.run();
    bench.tick(1003);
    Sample sample;
    bench.controller.take_sample(sample);
    // 5.7 s; the strobe was 2 to 13 ms ago
    TEST_ASSERT_UINT16_WITHIN(90, 11400, sample.phase[0]);
    TEST_ASSERT_UINT16_WITHIN(2, 49152, static_cast<uint16_t>(sample.phase[1] - sample.phase[0]));
    TEST_ASSERT_UINT16_WITHIN(2, 16384, static_cast<uint16_t>(sample.phase[2] - sample.phase[0]));
    bench.controller.stop();
    bench.tick(997);
  }
}

void test_first_sample_comes_with_the_tenth_tick_and_a_sample_is_numbered_from_1() {
  Bench bench;
  Sample sample;
  bench.tick(10);
  TEST_ASSERT_EQUAL_UINT16(1, bench.rounds);
  TEST_ASSERT_TRUE(bench.controller.take_sample(sample));
  TEST_ASSERT_EQUAL_UINT16(1, sample.sequence);
  TEST_ASSERT_EQUAL_UINT32(10000, sample.time_us);
}

void test_status_says_what_is_so() {
  Bench bench(StartCause::kBrownOut);
  bench.pressure(0, 500);
  bench.pressure(1, 520);
  bench.pressure(2, 560);
  bench.tick(25);
  bifa::Status status = bench.controller.status();
  equal(State::kFault, status.state);
  equal(Fault::kBrownOut, status.fault.fault);
  TEST_ASSERT_EQUAL_UINT8(bifa::kNoChannel, status.fault.channel);
  TEST_ASSERT_EQUAL_UINT8(3, bifa::kNoChannel);  // as the host knows it
  TEST_ASSERT_EQUAL_INT16(0, status.fault.value);
  TEST_ASSERT_EQUAL_INT16(0, status.fault.limit);
  TEST_ASSERT_EQUAL_UINT32(25, status.uptime_ms);
  TEST_ASSERT_EQUAL_UINT32(25, bench.controller.uptime_ms());
  TEST_ASSERT_EQUAL_UINT16(1, status.samples_lost);
  for (uint8_t i = 0; i < 3; ++i) {
    TEST_ASSERT_INT16_WITHIN(5, bifa::sensor_mpsi(bench.round.sum[i]), status.pressure_mpsi[i]);
  }
  TEST_ASSERT_FALSE(status.emergency_stop);
  bench.pressed = true;
  bench.tick();
  TEST_ASSERT_TRUE(bench.controller.status().emergency_stop);
  bench.pressed = false;
  bench.tick();
  bench.clear();
  bench.controller.hold(Chamber::kTail, ChamberState::kPositive);
  bench.tick(2);
  status = bench.controller.status();
  TEST_ASSERT_FALSE(status.emergency_stop);
  TEST_ASSERT_EQUAL_HEX8(0x10, status.valves);
}

void test_lost_samples_are_counted_up_to_65535() {
  Bench bench;
  for (uint32_t i = 0; i < 65534; ++i) bench.controller.lose_sample();
  TEST_ASSERT_EQUAL_UINT16(65534, bench.controller.status().samples_lost);
  for (uint8_t i = 0; i < 3; ++i) bench.controller.lose_sample();
  TEST_ASSERT_EQUAL_UINT16(65535, bench.controller.status().samples_lost);
}

void test_calibration_at_the_start_is_that_of_the_board() {
  const Calibration calibration = {{100, -200, 300}};
  Controller controller;
  controller.begin(StartCause::kPower, bifa::factory_preset(0), calibration);
  for (uint8_t ms = 0; ms < 12; ++ms) {
    if (controller.tick(false)) controller.converted_in_interrupt({{kZero, kZero, kZero}, kMonitorZero});
  }
  for (uint8_t i = 0; i < 3; ++i) {
    TEST_ASSERT_EQUAL_INT16(calibration.offset_mpsi[i], controller.calibration().offset_mpsi[i]);
    TEST_ASSERT_EQUAL_INT16(bifa::sensor_mpsi(kZero) - calibration.offset_mpsi[i],
                            controller.status().pressure_mpsi[i]);
  }
}

void test_a_mark_leaves_ten_strobes_out_and_names_the_sample_after_them() {
  for (uint8_t when_ms = 0; when_ms < 25; ++when_ms) {
    Bench bench;
    equal_u16(0, bench.controller.marked());
    uint16_t left_out = 0, first_after = 0;
    for (uint16_t ms = 0; ms < 300; ++ms) {
      if (ms == when_ms) bench.controller.mark_strobe();
      bench.tick();
      Sample sample;
      if (!bench.controller.take_sample(sample)) continue;
      const bool strobed = bench.strobed;  // in the round that this sample came from
      if (!strobed) ++left_out;
      if (strobed && left_out > 0 && first_after == 0) first_after = sample.sequence;
    }
    equal_u16(10, left_out);
    equal_u16(bench.controller.marked(), first_after);
  }
}

void test_samples_that_nobody_takes_are_counted() {
  Bench bench;
  bench.tick(1005);
  TEST_ASSERT_UINT16_WITHIN(2, 99, bench.controller.status().samples_lost);
}

void test_zero_is_measured_while_idle_and_taken_off_every_sample() {
  Bench bench;
  bench.noisy = false;
  bench.pressure(0, 518);
  bench.tick(5000);
  Calibration zero;
  equal(Verdict::kDone, bench.controller.measure_zero(zero));
  TEST_ASSERT_INT16_WITHIN(5, 238, zero.offset_mpsi[0]);  // 6.5 steps of 36.6
  bench.controller.calibrate(zero);
  bench.tick(20);
  TEST_ASSERT_INT16_WITHIN(5, 0, bench.controller.status().pressure_mpsi[0]);
  bench.controller.run();
  equal(Verdict::kRefused, bench.controller.measure_zero(zero));
}

void test_a_chamber_under_pressure_is_not_taken_for_zero() {
  Bench bench;
  bench.pressure(1, 512 + 40);  // 1.5 psi
  bench.tick(8000);
  Calibration zero;
  equal(Verdict::kOffset, bench.controller.measure_zero(zero));
}

void test_air_that_was_held_is_not_taken_for_zero() {
  Bench bench;
  bench.noisy = false;
  bench.pressure(0, 530);  // 0.7 psi, which the regulator may leave at a set-point of 0
  equal(Verdict::kDone, bench.controller.hold(Chamber::kBody, ChamberState::kPositive));
  bench.tick(6000);
  bench.controller.stop();
  bench.tick(20);
  Calibration zero;
  equal(Verdict::kUnrest, bench.controller.measure_zero(zero));
  bench.tick(4100);
  equal(Verdict::kDone, bench.controller.measure_zero(zero));
}

// A chamber that vents through its valve: 8.5 psi at first, a time constant of 1.7 s.
void test_zero_is_not_taken_while_a_chamber_still_vents() {
  Bench bench;
  double pressure_psi = 8.5;
  Calibration zero;
  uint16_t taken_ms = 0;
  for (uint16_t ms = 0; ms < 30000 && taken_ms == 0; ms += 10) {
    pressure_psi *= 1 - 0.01 / 1.7;
    bench.round.sum[0] = static_cast<uint16_t>(kZero + pressure_psi * 1024 * bifa::kOversampling / 37.5);
    bench.tick(10);
    if (bench.controller.measure_zero(zero) == Verdict::kDone) taken_ms = ms;
  }
  TEST_ASSERT_TRUE(taken_ms > 0);
  TEST_ASSERT_INT16_WITHIN(40, 0, zero.offset_mpsi[0]);
  bench.round.sum[0] += 20;
  bench.tick(1000);
  equal(Verdict::kUnrest, bench.controller.measure_zero(zero));
}

// ---- faults ----

void test_a_clear_with_nothing_to_release_keeps_what_the_watches_have_counted() {
  Bench bench;
  bench.controller.run();
  bench.tick(100);
  bench.pressure(2, 512 + 330);
  for (uint8_t i = 0; i < 5; ++i) {
    bench.tick(50);
    bench.clear();
  }
  equal(Fault::kOverPressure, bench.fault());
}

void test_over_pressure_vents_latches_and_is_not_cleared_while_it_stands() {
  Bench bench;
  bench.controller.run();
  bench.tick(100);
  bench.pressure(2, 512 + 330);  // 12.1 psi; the trip is at 10.5
  bench.tick(250);
  equal(Fault::kOverPressure, bench.fault());
  TEST_ASSERT_EQUAL_HEX8(0, pins);
  TEST_ASSERT_EQUAL_UINT16(0, bench.controller.supply().counts());
  const bifa::FaultReport report = bench.controller.status().fault;
  TEST_ASSERT_EQUAL_UINT8(2, report.channel);
  TEST_ASSERT_EQUAL_INT16(10500, report.limit);
  TEST_ASSERT_INT16_WITHIN(40, 12100, report.value);
  TEST_ASSERT_INT16_WITHIN(40, 12100, report.highest_mpsi[2]);
  equal(Verdict::kCauseStands, bench.clear());
  bench.pressure(2, 512);
  bench.tick(20);
  equal(Verdict::kDone, bench.clear());
  equal(State::kIdle, bench.state());
  TEST_ASSERT_TRUE(bench.controller.supply().counts() > 0);
}

void test_a_spike_of_a_hundred_milliseconds_is_borne() {
  Bench bench;
  bench.controller.run();
  bench.pressure(2, 512 + 330);
  bench.tick(100);
  bench.pressure(2, 512);
  bench.tick(500);
  equal(State::kRunning, bench.state());
}

void test_a_broken_sensor_is_a_fault_in_any_state_even_idle() {
  Bench bench;
  bench.pressure(0, 0);
  bench.tick(100);
  equal(Fault::kSensorRange, bench.fault());
  equal(Verdict::kCauseStands, bench.clear());
}

void test_over_pressure_behind_a_loose_plug_is_not_cleared() {
  Bench bench;
  bench.controller.run();
  bench.pressure(2, 512 + 330);
  bench.tick(250);
  equal(Fault::kOverPressure, bench.fault());
  bench.pressure(2, 0);
  bench.tick(10);
  equal(Verdict::kCauseStands, bench.clear());
  bench.pressure(2, 512 + 330);
  for (uint8_t ms = 0; ms < 10; ++ms) {  // also between a round and the tick that evaluates it
    bench.tick();
    equal(Verdict::kCauseStands, bench.clear());
  }
}

void test_a_stuck_sensor_is_a_fault_while_walking() {
  Bench bench;
  bench.noisy = false;
  bench.controller.run();
  bench.tick(5700);
  equal(Fault::kSensorStuck, bench.fault());
}

/// Ticks until a fault, at most `most`.
uint32_t ticks_to_fault(Bench& bench, uint32_t most) {
  uint32_t ticks = 0;
  for (; ticks < most && bench.fault() == Fault::kNone; ++ticks) bench.tick();
  return ticks;
}

void test_frozen_sensors_are_found_at_every_gait_of_the_box() {
  const uint32_t periods_us[] = {500000, 2720000, 5700000, 60000000};
  const uint16_t duties_e4[] = {500, 6600, 9500};
  for (uint32_t period_us : periods_us) {
    for (uint16_t duty_e4 : duties_e4) {
      ParameterSet set = bifa::factory_preset(0);
      set.period_us = period_us;
      set.duty_body_e4 = set.duty_head_e4 = set.duty_tail_e4 = duty_e4;
      Bench bench(StartCause::kPower, set);
      bench.noisy = false;
      bench.controller.run();
      const uint32_t first_switch_ms = period_us / 1000;  // at the latest
      TEST_ASSERT_TRUE(ticks_to_fault(bench, 60000 + first_switch_ms) <= first_switch_ms + 2100);
      equal(Fault::kSensorStuck, bench.fault());
    }
  }
}

void test_an_open_input_is_found_within_two_seconds_whatever_the_valves_do() {
  for (uint8_t seed = 1; seed <= 20; ++seed) {
    Bench bench;
    uint32_t chance = seed;
    if (seed % 2) bench.controller.run();
    for (uint16_t sample = 0; sample < 200; ++sample) {
      chance = chance * 1664525UL + 1013904223UL;
      bench.round.sum[1] = bifa::kSensorLow + (chance >> 16) % (bifa::kSensorHigh - bifa::kSensorLow);
      bench.tick(10);
    }
    equal(Fault::kSensorStuck, bench.fault());
    TEST_ASSERT_EQUAL_UINT8(1, bench.controller.status().fault.channel);
  }
}

// The worst case of real air: full supply and full vacuum every 20 ms at a sensor near the valves, with overshoot.
void test_pressures_that_follow_their_valves_are_no_open_input_at_the_fastest_gait() {
  ParameterSet set = bifa::factory_preset(0);
  set.period_us = 500000;
  Bench bench(StartCause::kPower, set);
  bench.controller.run();
  for (uint16_t sample = 0; sample < 6000; ++sample) {
    const bool positive = sample % 25 < 12;
    const bool overshoot = sample % 25 == 0 || sample % 25 == 12;
    const double pressure_psi = (positive ? 8.0 : -12.5) * (overshoot ? 1.15 : 1.0);
    for (uint16_t& sum : bench.round.sum) {
      sum = static_cast<uint16_t>(kZero + pressure_psi * 1024 * bifa::kOversampling / 37.5);
    }
    bench.tick(10);
    equal(Fault::kNone, bench.fault());
  }
}

void test_over_pressure_in_pieces_adds_up() {
  Bench bench;
  bench.controller.run();
  for (uint8_t turn = 0; turn < 5 && bench.fault() == Fault::kNone; ++turn) {
    bench.pressure(2, 512 + 330);
    bench.tick(190);
    bench.pressure(2, 512);
    bench.tick(10);
  }
  equal(Fault::kOverPressure, bench.fault());
}

void test_a_silent_host_vents_when_it_was_asked_to() {
  ParameterSet set = bifa::factory_preset(0);
  set.host_timeout_ms = 500;
  Bench bench(StartCause::kPower, set);
  bench.tick(5000);
  equal(State::kIdle, bench.state());  // nothing to vent
  bench.controller.run();
  for (uint8_t i = 0; i < 10; ++i) {
    bench.tick(400);
    bench.controller.host_heard();
  }
  equal(State::kRunning, bench.state());
  bench.tick(499);
  equal(State::kRunning, bench.state());
  bench.tick(1);
  equal(Fault::kHostSilent, bench.fault());
  equal(Verdict::kDone, bench.clear());
}

void test_silence_of_the_host_counts_from_the_command_that_moves_air() {
  ParameterSet set = bifa::factory_preset(0);
  set.host_timeout_ms = 500;
  for (uint8_t way = 0; way < 3; ++way) {
    Bench bench(StartCause::kPower, set);
    bench.controller.schedule_add(10, Chamber::kBody, ChamberState::kVacuum);
    bench.tick(3000);
    if (way == 0) bench.controller.run();
    if (way == 1) bench.controller.hold(Chamber::kBody, ChamberState::kVacuum);
    if (way == 2) bench.controller.schedule_start();
    bench.tick(499);
    equal(Fault::kNone, bench.fault());
    TEST_ASSERT_TRUE(pins != 0);
    bench.tick();
    equal(Fault::kHostSilent, bench.fault());
    const bifa::FaultReport report = bench.controller.status().fault;
    TEST_ASSERT_EQUAL_UINT8(bifa::kNoChannel, report.channel);
    TEST_ASSERT_EQUAL_INT16(50, report.value);
    TEST_ASSERT_EQUAL_INT16(50, report.limit);
    TEST_ASSERT_EQUAL_UINT32(3500, report.time_ms);
  }
  Bench bench(StartCause::kPower, set);
  bench.controller.run();
  bench.tick(300);
  bench.controller.host_heard();
  bench.tick(499);
  equal(Fault::kNone, bench.fault());
  bench.tick();
  equal(Fault::kHostSilent, bench.fault());
}

void test_the_longest_time_out_is_a_minute() {
  ParameterSet set = bifa::factory_preset(0);
  set.host_timeout_ms = 60000;
  Bench bench(StartCause::kPower, set);
  bench.controller.run();
  bench.tick(59999);
  equal(State::kRunning, bench.state());
  bench.tick();
  equal(Fault::kHostSilent, bench.fault());
  TEST_ASSERT_EQUAL_INT16(6000, bench.controller.status().fault.value);
}

void test_a_clear_forgets_what_every_sensor_has_counted() {
  for (uint8_t chamber = 0; chamber < 3; ++chamber) {
    Bench bench;
    bench.tick(100);
    bench.pressure(chamber, 512 + 330);
    bench.tick(190);
    bench.stop_byte();
    equal(Verdict::kDone, bench.clear());
    bench.tick(150);
    equal(Fault::kNone, bench.fault());
    bench.tick(60);
    equal(Fault::kOverPressure, bench.fault());
    TEST_ASSERT_EQUAL_UINT8(chamber, bench.controller.status().fault.channel);
  }
}

void test_a_clear_does_not_shorten_the_time_that_a_valve_needs_to_close() {
  for (uint8_t chamber = 0; chamber < 3; ++chamber) {
    Bench bench;
    const Chamber which = static_cast<Chamber>(chamber);
    bench.controller.hold(which, ChamberState::kPositive);
    bench.tick(100);
    bench.stop_byte();
    equal(Verdict::kDone, bench.clear());
    bench.controller.hold(which, ChamberState::kVacuum);
    bench.tick(3);
    TEST_ASSERT_EQUAL_HEX8(0, pins);
    bench.tick();
    TEST_ASSERT_EQUAL_HEX8(2 << 2 * chamber, pins);
  }
}

void test_a_fault_is_not_cleared_while_any_chamber_has_its_cause() {
  for (uint8_t chamber = 0; chamber < 3; ++chamber) {
    Bench bench;
    bench.pressure(0, 512 + 330);
    bench.tick(230);
    equal(Fault::kOverPressure, bench.fault());
    bench.pressure(0, 512);
    bench.pressure(chamber, 512 + 330);
    bench.tick(20);
    equal(Verdict::kCauseStands, bench.clear());
    bench.pressure(chamber, 512);
    bench.tick(20);
    equal(Verdict::kDone, bench.clear());
  }
}

void test_what_stands_for_one_fault_does_not_keep_another() {
  Bench bench;
  bench.round.monitor = 258;  // 8.5 psi, which deviates from a fault's set-point of 0
  bench.tick(1100);
  bench.pressure(0, 512 + 330);
  bench.tick(230);
  equal(Fault::kOverPressure, bench.fault());
  bench.pressure(0, 512);
  bench.tick(20);
  equal(Verdict::kDone, bench.clear());
}

void test_a_fault_keeps_the_extremes_of_every_chamber() {
  Bench bench;
  bench.noisy = false;
  bench.tick(200);
  bench.pressure(0, 532);
  bench.pressure(1, 482);
  bench.tick(20);
  bench.pressure(0, 512);
  bench.pressure(1, 512);
  bench.tick(20);
  bench.pressure(2, 1023);
  bench.tick(60);
  const bifa::FaultReport report = bench.controller.status().fault;
  equal(Fault::kSensorRange, report.fault);
  const int16_t zero = bifa::sensor_mpsi(kZero);
  TEST_ASSERT_EQUAL_INT16(zero, report.lowest_mpsi[0]);
  TEST_ASSERT_EQUAL_INT16(bifa::sensor_mpsi(532 * 8), report.highest_mpsi[0]);
  TEST_ASSERT_EQUAL_INT16(bifa::sensor_mpsi(482 * 8), report.lowest_mpsi[1]);
  TEST_ASSERT_EQUAL_INT16(zero, report.highest_mpsi[1]);
  TEST_ASSERT_EQUAL_INT16(zero, report.lowest_mpsi[2]);
  TEST_ASSERT_EQUAL_INT16(bifa::sensor_mpsi(1023 * 8), report.highest_mpsi[2]);
  TEST_ASSERT_EQUAL_INT16(bifa::sensor_mpsi(1023 * 8), report.value);
  TEST_ASSERT_EQUAL_INT16(bifa::sensor_mpsi(bifa::kSensorHigh), report.limit);
}

void test_a_regulator_that_does_not_follow_is_a_fault_and_a_clear_forgets_what_was_counted() {
  const uint16_t at_8_5_psi = 258, at_20_psi = 330;
  Bench bench;
  bench.round.monitor = at_8_5_psi;
  bench.controller.run();
  bench.tick(2000);
  bench.round.monitor = at_20_psi;
  bench.tick(2400);
  equal(State::kRunning, bench.state());
  bench.stop_byte();
  equal(Verdict::kDone, bench.clear());
  bench.tick(2400);
  equal(Fault::kNone, bench.fault());
  bench.tick(200);
  equal(Fault::kRegulator, bench.fault());
  const bifa::FaultReport report = bench.controller.status().fault;
  TEST_ASSERT_EQUAL_UINT8(bifa::kNoChannel, report.channel);
  TEST_ASSERT_EQUAL_INT16(bifa::monitor_mpsi(at_20_psi), report.value);
  TEST_ASSERT_EQUAL_INT16(8500, report.limit);
  bench.round.monitor = at_8_5_psi;
  bench.tick(20);
  equal(Verdict::kCauseStands, bench.clear());  // in a fault the set-point is 0
  bench.round.monitor = 205;
  bench.tick(20);
  equal(Verdict::kDone, bench.clear());
}

void test_without_a_time_out_the_host_may_be_silent_forever() {
  Bench bench;
  bench.controller.run();
  bench.tick(70000);
  equal(State::kRunning, bench.state());
}

void test_a_dac_that_does_not_answer_is_a_fault_until_it_does() {
  Bench bench;
  bench.controller.supply_told(false);
  bench.controller.supply_told(false);
  equal(State::kIdle, bench.state());
  bench.controller.supply_told(false);
  equal(Fault::kSupplyControl, bench.fault());
  TEST_ASSERT_EQUAL_UINT8(bifa::kNoChannel, bench.controller.status().fault.channel);
  TEST_ASSERT_EQUAL_INT16(3, bench.controller.status().fault.value);
  TEST_ASSERT_EQUAL_INT16(2, bench.controller.status().fault.limit);
  equal(Verdict::kCauseStands, bench.clear());
  bench.controller.supply_told(true);
  equal(Verdict::kDone, bench.clear());
}

void test_after_the_watchdog_it_starts_in_a_fault() {
  Bench bench(StartCause::kWatchdog);
  equal(Fault::kWatchdog, bench.fault());
  equal(Verdict::kLatched, bench.controller.run());
  equal(Verdict::kDone, bench.clear());
}

void test_after_a_brown_out_it_starts_in_a_fault() {
  Bench bench(StartCause::kBrownOut);
  equal(Fault::kBrownOut, bench.fault());
}

void test_after_a_restart_of_unknown_cause_it_starts_in_a_fault() {
  Bench bench(StartCause::kRestart);
  equal(Fault::kRestart, bench.fault());
}

void test_after_a_reset_from_outside_it_starts_idle() {
  Bench bench(StartCause::kExternal);
  equal(State::kIdle, bench.state());
}

void test_a_stop_on_top_of_a_fault_leaves_the_fault_to_be_read() {
  Bench bench(StartCause::kWatchdog);
  bench.stop_byte();
  equal(State::kFault, bench.state());
  equal(Fault::kWatchdog, bench.fault());
}

// ---- data shared between the interrupts and the main loop ----

/// How many guards a call enters.
template <typename Call>
unsigned guards(Call call) {
  const unsigned before = bifa::Critical::entered();
  call();
  return bifa::Critical::entered() - before;
}

void test_everything_that_the_main_loop_calls_is_guarded() {
  Bench bench;
  Controller& controller = bench.controller;
  const Calibration calibration = {};
  const ParameterSet set = bifa::factory_preset(0);
  Calibration measured;
  Sample sample;
  TEST_ASSERT_EQUAL(1, guards([&] { controller.hold(Chamber::kBody, ChamberState::kVacuum); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.stop(); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.run(); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.clear(); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.apply(set); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.schedule_add(0, Chamber::kBody, ChamberState::kOff); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.schedule_start(); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.schedule_clear(); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.measure_zero(measured); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.calibrate(calibration); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.mark_strobe(); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.marked(); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.take_sample(sample); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.lose_sample(); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.status(); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.uptime_ms(); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.host_heard(); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.supply(); }));
  TEST_ASSERT_EQUAL(1, guards([&] { controller.supply_told(true); }));
  TEST_ASSERT_EQUAL(0, bifa::Critical::depth());
}

// Other interrupts may nest in the tick: a stop may come between any two of its parts.
void test_every_part_of_a_tick_that_a_stop_could_interrupt_is_guarded() {
  Bench bench;
  const auto tick = [&] { bench.tick(); };
  bench.tick(8);
  TEST_ASSERT_EQUAL(2, guards(tick));  // the buttons, the valves; with the next one a sample begins
  TEST_ASSERT_EQUAL(3, guards(tick));
  bench.tick(5);
  bench.controller.schedule_add(1000, Chamber::kBody, ChamberState::kOff);
  bench.controller.schedule_start();
  TEST_ASSERT_EQUAL(3, guards(tick));
  bench.controller.stop();
  bench.controller.run();
  TEST_ASSERT_EQUAL(3, guards(tick));
}

// ---- the set-point ----

void test_pressures_beyond_14_psi_end_at_14_psi_even_from_a_set_that_nobody_checked() {
  ParameterSet set = bifa::factory_preset(0);
  set.pressure_mpsi = 65535;
  Bench bench(StartCause::kPower, set);
  TEST_ASSERT_EQUAL_UINT16(441, bench.controller.supply().counts());
}

void run() {
  RUN_TEST(test_it_starts_idle_and_vented);
  RUN_TEST(test_run_walks_with_the_body_at_vacuum_first);
  RUN_TEST(test_stop_vents_and_returns_to_idle);
  RUN_TEST(test_hold_is_for_idle_and_holding_only);
  RUN_TEST(test_a_stop_byte_latches_until_clear);
  RUN_TEST(test_a_clear_that_came_before_the_stop_does_not_undo_it);
  RUN_TEST(test_a_clear_that_came_before_the_fault_does_not_undo_it);
  RUN_TEST(test_emergency_stop_holds_as_long_as_it_is_pressed);
  RUN_TEST(test_emergency_stop_that_is_pressed_at_power_up_counts);
  RUN_TEST(test_a_set_that_comes_while_running_does_not_make_the_phases_jump);
  RUN_TEST(test_timed_holds_come_on_their_tick);
  RUN_TEST(test_a_stop_ends_timed_holds);
  RUN_TEST(test_timed_holds_do_not_outlive_a_stop_that_is_cleared_within_a_tick);
  RUN_TEST(test_a_schedule_has_room_for_sixteen);
  RUN_TEST(test_nothing_walks_while_timed_holds_wait);
  RUN_TEST(test_timed_holds_that_run_are_not_started_again);
  RUN_TEST(test_clearing_timed_holds_that_run_vents_what_they_hold);
  RUN_TEST(test_clearing_timed_holds_that_do_not_run_leaves_held_chambers_alone);
  RUN_TEST(test_timed_holds_that_wait_for_longer_than_the_host_may_be_silent_open_no_valve);
  RUN_TEST(test_a_hold_that_falls_due_as_the_host_becomes_too_silent_opens_no_valve);
  RUN_TEST(test_stop_ends_timed_holds_for_good);
  RUN_TEST(test_a_schedule_that_is_started_again_begins_at_time_0);
  RUN_TEST(test_an_empty_schedule_does_not_run);
  RUN_TEST(test_timed_holds_are_not_started_while_it_walks);
  RUN_TEST(test_every_chamber_and_state_can_be_held_at_a_time_even_at_the_same);
  RUN_TEST(test_a_sample_every_ten_milliseconds_stamped_with_the_strobe);
  RUN_TEST(test_a_sample_says_what_stood_at_its_strobe);
  RUN_TEST(test_phases_of_a_sample_are_turns_of_65536_and_every_walk_begins_with_the_body_at_0);
  RUN_TEST(test_first_sample_comes_with_the_tenth_tick_and_a_sample_is_numbered_from_1);
  RUN_TEST(test_status_says_what_is_so);
  RUN_TEST(test_lost_samples_are_counted_up_to_65535);
  RUN_TEST(test_calibration_at_the_start_is_that_of_the_board);
  RUN_TEST(test_a_mark_leaves_ten_strobes_out_and_names_the_sample_after_them);
  RUN_TEST(test_samples_that_nobody_takes_are_counted);
  RUN_TEST(test_zero_is_measured_while_idle_and_taken_off_every_sample);
  RUN_TEST(test_a_chamber_under_pressure_is_not_taken_for_zero);
  RUN_TEST(test_air_that_was_held_is_not_taken_for_zero);
  RUN_TEST(test_zero_is_not_taken_while_a_chamber_still_vents);
  RUN_TEST(test_frozen_sensors_are_found_at_every_gait_of_the_box);
  RUN_TEST(test_an_open_input_is_found_within_two_seconds_whatever_the_valves_do);
  RUN_TEST(test_pressures_that_follow_their_valves_are_no_open_input_at_the_fastest_gait);
  RUN_TEST(test_over_pressure_in_pieces_adds_up);
  RUN_TEST(test_a_clear_with_nothing_to_release_keeps_what_the_watches_have_counted);
  RUN_TEST(test_over_pressure_vents_latches_and_is_not_cleared_while_it_stands);
  RUN_TEST(test_a_spike_of_a_hundred_milliseconds_is_borne);
  RUN_TEST(test_a_broken_sensor_is_a_fault_in_any_state_even_idle);
  RUN_TEST(test_over_pressure_behind_a_loose_plug_is_not_cleared);
  RUN_TEST(test_a_stuck_sensor_is_a_fault_while_walking);
  RUN_TEST(test_a_silent_host_vents_when_it_was_asked_to);
  RUN_TEST(test_silence_of_the_host_counts_from_the_command_that_moves_air);
  RUN_TEST(test_the_longest_time_out_is_a_minute);
  RUN_TEST(test_a_clear_forgets_what_every_sensor_has_counted);
  RUN_TEST(test_a_clear_does_not_shorten_the_time_that_a_valve_needs_to_close);
  RUN_TEST(test_a_fault_is_not_cleared_while_any_chamber_has_its_cause);
  RUN_TEST(test_what_stands_for_one_fault_does_not_keep_another);
  RUN_TEST(test_a_fault_keeps_the_extremes_of_every_chamber);
  RUN_TEST(test_a_regulator_that_does_not_follow_is_a_fault_and_a_clear_forgets_what_was_counted);
  RUN_TEST(test_without_a_time_out_the_host_may_be_silent_forever);
  RUN_TEST(test_a_dac_that_does_not_answer_is_a_fault_until_it_does);
  RUN_TEST(test_after_the_watchdog_it_starts_in_a_fault);
  RUN_TEST(test_after_a_brown_out_it_starts_in_a_fault);
  RUN_TEST(test_after_a_restart_of_unknown_cause_it_starts_in_a_fault);
  RUN_TEST(test_after_a_reset_from_outside_it_starts_idle);
  RUN_TEST(test_a_stop_on_top_of_a_fault_leaves_the_fault_to_be_read);
  RUN_TEST(test_everything_that_the_main_loop_calls_is_guarded);
  RUN_TEST(test_every_part_of_a_tick_that_a_stop_could_interrupt_is_guarded);
  RUN_TEST(test_pressures_beyond_14_psi_end_at_14_psi_even_from_a_set_that_nobody_checked);
}

}  // namespace

void bifa::set_valves(ValvePattern pattern) {
  TEST_ASSERT_TRUE(Critical::depth() > 0);
  pins = pattern.bits();
  ever_on |= pins;
}
void bifa::outdate_input() { TEST_ASSERT_TRUE(Critical::depth() > 0); }

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
