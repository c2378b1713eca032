// The Uno's end of a session, frame by frame: which commands are executed, how often, and every field of every answer.
#include <unity.h>

#include <string>

#include "../../suite.h"
#include "crc.h"
#include "output.h"
#include "session.h"

using namespace bifa;

namespace {

const uint16_t kNonce = 0x0507;
const uint16_t kKey = 0x1234;
const LinkCounters kCounters = {0x0102, 0x0304};

uint8_t pins = 0;
std::string sent;
uint8_t room = 127;
uint8_t cells[kEepromBytes];
uint8_t cells_busy = 0;  ///< for this many milliseconds

/// A session on a board whose converter answers immediately.
struct Bench {
  Controller controller;
  Commands commands;
  Session session;
  uint16_t sums[kChamberCount] = {4096, 4096, 4096};
  bool pressed = false;
  uint8_t sequence = 0;
  uint8_t turn = 0;

  explicit Bench(StartCause cause = StartCause::kPower) : commands(controller), session(commands) {
    pins = cells_busy = 0;
    room = 127;
    memset(cells, 0xFF, sizeof cells);
    commands.begin(cause);
    session.begin(kNonce, cause);
    sent.clear();
  }

  void wait(uint32_t ms) {
    for (; ms > 0; --ms) {
      if (cells_busy > 0) --cells_busy;
      commands.poll();
      session.poll();
      if (controller.tick(pressed)) {
        RawRound round = {{sums[0], sums[1], sums[2]}, 0};
        if (turn++ % 2) ++round.sum[0], ++round.sum[1], ++round.sum[2];
        controller.converted_in_interrupt(round);
      }
      Sample sample;
      if (controller.take_sample(sample)) commands.follow(sample);
    }
  }

  void take(MessageId message, uint8_t number, const void* fields = nullptr, uint8_t size = 0) {
    sent.clear();
    Frame frame = {};
    frame.message = static_cast<uint8_t>(message);
    frame.sequence = number;
    if (size > 0) memcpy(frame.fields, fields, size);
    controller.hear_from_now_on();
    session.take(frame, kCounters);
  }
  template <typename Fields>
  void take(MessageId message, uint8_t number, const Fields& fields) {
    take(message, number, &fields, sizeof fields);
  }
  void connect(uint16_t key = kKey) {
    take(MessageId::kConnect, 0, ConnectMessage{kNonce, key});
    sequence = 0;
  }
  /// Executes the next command of the session.
  Result call(MessageId message, const void* fields = nullptr, uint8_t size = 0);
  template <typename Fields>
  Result call(MessageId message, const Fields& fields) {
    return call(message, &fields, sizeof fields);
  }
};

/// How many frames were sent.
uint8_t frames_sent() {
  uint8_t zeros = 0;
  for (char c : sent) zeros += c == 0;
  return zeros / 3;
}

/// The body of the only frame that was sent; its checks must match `seed`.
std::string body_sent(uint32_t seed) {
  TEST_ASSERT_EQUAL_UINT8(1, frames_sent());
  TEST_ASSERT_EQUAL_UINT8(0, sent[0] | sent[1] | sent[sent.size() - 1]);
  std::string body;
  for (size_t at = 2; at + 1 < sent.size();) {
    const uint8_t run = static_cast<uint8_t>(sent[at]);
    body += sent.substr(at + 1, run - 1);
    at += run;
    if (at + 1 < sent.size()) body += '\0';
  }
  uint16_t first = static_cast<uint16_t>(seed), second = static_cast<uint16_t>(seed >> 16);
  for (size_t at = 0; at + 4 < body.size(); ++at) {
    first = crc16_update(first, static_cast<uint8_t>(body[at]));
    second = crc16_reflected_update(second, static_cast<uint8_t>(body[at]));
  }
  const uint16_t checks[] = {first, second};
  TEST_ASSERT_EQUAL_MEMORY(checks, body.data() + body.size() - 4, 4);
  return body.substr(0, body.size() - 4);
}

/// The fields of the only frame that was sent, which must be this report.
template <typename Fields>
Fields report(MessageId message, uint8_t sequence, uint32_t seed) {
  const std::string body = body_sent(seed);
  TEST_ASSERT_EQUAL_HEX8(static_cast<uint8_t>(message), body[0]);
  TEST_ASSERT_EQUAL_UINT8(sequence, body[1]);
  TEST_ASSERT_EQUAL(2 + sizeof(Fields), body.size());
  Fields fields;
  memcpy(&fields, body.data() + 2, sizeof fields);
  return fields;
}
template <typename Fields>
Fields report(MessageId message, uint8_t sequence) {
  return report<Fields>(message, sequence, session_seed(kKey));
}

/// The result that was sent for command number `sequence`.
Result done(uint8_t sequence) { return static_cast<Result>(report<DoneMessage>(MessageId::kDone, sequence).result); }

Result Bench::call(MessageId message, const void* fields, uint8_t size) {
  take(message, sequence, fields, size);
  return done(sequence++);
}

void equal(Result expected, Result actual) {
  TEST_ASSERT_EQUAL_UINT8(static_cast<uint8_t>(expected), static_cast<uint8_t>(actual));
}
void equal(State expected, const Bench& bench) {
  TEST_ASSERT_EQUAL_UINT8(static_cast<uint8_t>(expected), static_cast<uint8_t>(bench.controller.state()));
}

/// Fills the stack with letters where the next call puts its variables.
__attribute__((noinline)) void litter_the_stack() {
  volatile char letters[1024];
  for (volatile char& letter : letters) letter = 'z';
}

// ---- opening ----

void is_hello(const HelloMessage& hello, uint16_t key, StartCause cause) {
  TEST_ASSERT_EQUAL_UINT8(kProtocolVersion, hello.protocol);
  for (uint8_t i = 0; i < 3; ++i) TEST_ASSERT_EQUAL_UINT8(kFirmwareVersion[i], hello.firmware[i]);
  TEST_ASSERT_EQUAL_HEX32(kTableHash, hello.table_hash);
  TEST_ASSERT_EQUAL_HEX16(kNonce, hello.boot_nonce);
  TEST_ASSERT_EQUAL_UINT8(static_cast<uint8_t>(cause), hello.start_cause);
  TEST_ASSERT_EQUAL_HEX16(key, hello.session_key);
}

void test_hello_says_which_versions_which_start_and_which_session() {
  Bench bench(StartCause::kExternal);
  bench.take(MessageId::kVersion, 9);
  is_hello(report<HelloMessage>(MessageId::kHello, 0, kOpenSeed), 0, StartCause::kExternal);
  bench.take(MessageId::kVersion, 9, ConnectMessage{kNonce, kKey});  // fields as an earlier frame may have left them
  is_hello(report<HelloMessage>(MessageId::kHello, 0, kOpenSeed), 0, StartCause::kExternal);
  bench.connect();
  is_hello(report<HelloMessage>(MessageId::kHello, 0, kOpenSeed), kKey, StartCause::kExternal);
  TEST_ASSERT_EQUAL_HEX16(kNonce, bench.session.boot_nonce());
  TEST_ASSERT_TRUE(bench.session.cause() == StartCause::kExternal);
}

void test_connect_with_the_nonce_of_another_start_opens_nothing() {
  Bench bench;
  bench.take(MessageId::kConnect, 0, ConnectMessage{kNonce + 1, kKey});
  is_hello(report<HelloMessage>(MessageId::kHello, 0, kOpenSeed), 0, StartCause::kPower);
  bench.take(MessageId::kStatus, 0);
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
}

void test_without_a_session_no_command_is_carried_out_or_answered() {
  Bench bench;
  bench.session.poll();
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
  bench.take(MessageId::kRun, 0);
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
  equal(State::kIdle, bench);
}

void test_the_stop_message_is_not_answered_as_a_command() {
  Bench bench;
  bench.connect();
  bench.take(MessageId::kStopNow, 0);
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
  equal(Result::kOk, bench.call(MessageId::kRun));  // it did not use up a number either
}

void test_a_new_session_begins_at_number_0_and_sends_no_telemetry() {
  Bench bench;
  bench.connect();
  equal(Result::kOk, bench.call(MessageId::kStream, StreamMessage{1}));
  equal(Result::kOk, bench.call(MessageId::kRun));
  bench.connect();
  sent.clear();
  bench.session.sample(Sample());
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
  equal(Result::kOk, bench.call(MessageId::kStop));
}

void test_a_new_session_does_not_wait_for_what_an_earlier_one_saves() {
  Bench bench;
  bench.connect();
  bench.take(MessageId::kSave, 0, SaveMessage{{'a'}});
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
  bench.connect();
  equal(Result::kOk, bench.call(MessageId::kRun));
  sent.clear();
  bench.wait(2000);
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
}

void test_a_new_session_ends_timed_holds() {
  Bench bench;
  bench.connect();
  equal(Result::kOk, bench.call(MessageId::kScheduleAdd, ScheduleAddMessage{0, 0, 2}));
  equal(Result::kOk, bench.call(MessageId::kScheduleAdd, ScheduleAddMessage{9000, 0, 0}));
  equal(Result::kOk, bench.call(MessageId::kScheduleStart));
  bench.wait(10);
  TEST_ASSERT_EQUAL_HEX8(0x01, pins);
  bench.connect();
  TEST_ASSERT_EQUAL_HEX8(0, pins);
}

// ---- every command once and in order ----

void test_a_repeated_command_is_answered_from_memory_and_counted() {
  Bench bench;
  bench.connect();
  equal(Result::kOk, bench.call(MessageId::kRun));       // 0
  equal(Result::kRefused, bench.call(MessageId::kRun));  // 1
  equal(Result::kOk, bench.call(MessageId::kStop));      // 2
  equal(Result::kLatched, [&] {
    bench.controller.stop_in_interrupt();
    return bench.call(MessageId::kRun);
  }());  // 3
  const Result results[] = {Result::kOk, Result::kRefused, Result::kOk, Result::kLatched};
  for (uint8_t number = 0; number < 4; ++number) {
    bench.take(MessageId::kRun, number);
    equal(results[number], done(number));
    TEST_ASSERT_EQUAL_UINT16(number + 1, bench.session.repeated());
  }
  equal(State::kStopped, bench);
}

void test_after_a_gap_it_says_which_number_it_expects_and_does_nothing() {
  Bench bench;
  bench.connect();
  for (uint8_t number = 0; number < 7; ++number) equal(Result::kOk, bench.call(MessageId::kMark));
  for (uint16_t number = 0; number < 0x100; ++number) {
    const bool next = number == 7, repeated = number >= 3 && number < 7;
    if (next || repeated) continue;
    bench.take(MessageId::kRun, static_cast<uint8_t>(number));
    const std::string body = body_sent(session_seed(kKey));
    TEST_ASSERT_EQUAL(2, body.size());
    TEST_ASSERT_EQUAL_HEX8(static_cast<uint8_t>(MessageId::kExpected), body[0]);
    TEST_ASSERT_EQUAL_UINT8(7, body[1]);
    equal(State::kIdle, bench);
  }
  TEST_ASSERT_EQUAL_UINT16(0, bench.session.repeated());
}

void test_numbers_go_on_after_255() {
  Bench bench;
  bench.connect();
  for (uint16_t number = 0; number < 600; ++number) equal(Result::kOk, bench.call(MessageId::kMark));
  bench.take(MessageId::kMark, static_cast<uint8_t>(bench.sequence - 4));
  equal(Result::kOk, done(static_cast<uint8_t>(bench.sequence - 4)));
}

void test_a_repeated_question_is_answered_anew() {
  Bench bench;
  bench.connect();
  bench.take(MessageId::kStatus, 0);
  TEST_ASSERT_EQUAL_UINT16(0, report<StatusReportMessage>(MessageId::kStatusReport, 0).frames_repeated);
  bench.take(MessageId::kStatus, 0);
  TEST_ASSERT_EQUAL_UINT16(1, report<StatusReportMessage>(MessageId::kStatusReport, 0).frames_repeated);
}

void test_repeats_are_counted_up_to_65535() {
  Bench bench;
  bench.connect();
  equal(Result::kOk, bench.call(MessageId::kMark));
  for (uint32_t i = 0; i < 65534; ++i) bench.take(MessageId::kMark, 0);
  TEST_ASSERT_EQUAL_UINT16(65534, bench.session.repeated());
  for (uint8_t i = 0; i < 3; ++i) bench.take(MessageId::kMark, 0);
  TEST_ASSERT_EQUAL_UINT16(65535, bench.session.repeated());
}

void test_a_command_that_saves_is_answered_when_that_is_done_and_others_wait() {
  Bench bench;
  bench.connect();
  equal(Result::kOk, bench.call(MessageId::kMark));
  const SaveMessage save = {{'f', 'a', 's', 't'}};
  bench.take(MessageId::kSave, 1, save);
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
  bench.take(MessageId::kRun, 2);  // not yet
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
  equal(State::kIdle, bench);
  bench.take(MessageId::kSave, 1, save);  // again, too early
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
  bench.take(MessageId::kMark, 0);  // the one before it is still answered
  equal(Result::kOk, done(0));
  sent.clear();
  bench.wait(2000);
  equal(Result::kOk, done(1));
  bench.take(MessageId::kSave, 1, save);
  equal(Result::kOk, done(1));
  TEST_ASSERT_FALSE(bench.commands.store().busy());
  bench.sequence = 2;
  equal(Result::kOk, bench.call(MessageId::kRun));
}

void test_a_save_that_fails_is_answered_so() {
  Bench bench;
  bench.connect();
  equal(Result::kOk, bench.call(MessageId::kMark));
  bench.take(MessageId::kSave, 1, SaveMessage{{'a'}});
  for (uint16_t ms = 0; ms < 60000 && frames_sent() == 0; ++ms) {
    memset(cells, 0x55, sizeof cells);  // no cell retains a write
    bench.wait(1);
  }
  equal(Result::kEeprom, done(1));
  bench.take(MessageId::kSave, 1, SaveMessage{{'a'}});
  equal(Result::kEeprom, done(1));
  bench.take(MessageId::kMark, 0);
  equal(Result::kOk, done(0));
}

void test_a_zero_that_cannot_be_stored_changes_no_offset() {
  Bench bench;
  bench.connect();
  bench.sums[0] = 4096 + 40;
  bench.wait(11000);
  bench.take(MessageId::kZero, 0, ZeroMessage{0});
  for (uint16_t ms = 0; ms < 60000 && frames_sent() == 0; ++ms) {
    memset(cells, 0x55, sizeof cells);  // no cell retains a write
    bench.wait(1);
  }
  equal(Result::kEeprom, done(0));
  TEST_ASSERT_EQUAL_INT16(0, bench.controller.calibration().offset_mpsi[0]);
}

// ---- what each command does ----

void test_hold_takes_its_chamber_and_its_state() {
  for (uint8_t chamber = 0; chamber < 3; ++chamber) {
    for (uint8_t state = 1; state < 3; ++state) {
      Bench bench;
      bench.connect();
      equal(Result::kOk, bench.call(MessageId::kHold, HoldMessage{chamber, state}));
      bench.wait(5);
      TEST_ASSERT_EQUAL_HEX8((state == 2 ? 1 : 2) << 2 * chamber, pins);
    }
  }
  Bench bench;
  bench.connect();
  equal(Result::kRange, bench.call(MessageId::kHold, HoldMessage{3, 1}));
  equal(Result::kRange, bench.call(MessageId::kHold, HoldMessage{0, 3}));
}

void test_clear_releases_a_stop() {
  Bench bench;
  bench.connect();
  bench.controller.stop_in_interrupt();
  equal(Result::kOk, bench.call(MessageId::kClear));
  equal(State::kIdle, bench);
}

void test_sets_are_begun_filled_and_committed() {
  Bench bench;
  bench.connect();
  equal(Result::kOk, bench.call(MessageId::kBegin));
  const uint8_t period = static_cast<uint8_t>(ParameterId::kPeriodS);
  equal(Result::kOk, bench.call(MessageId::kField, FieldMessage{period, 2000000}));
  equal(Result::kRange, bench.call(MessageId::kField, FieldMessage{period, 1}));
  equal(Result::kTransaction, bench.call(MessageId::kCommit, CommitMessage{0}));
  equal(Result::kOk, bench.call(MessageId::kBegin));
  equal(Result::kOk, bench.call(MessageId::kField, FieldMessage{period, 2000000}));
  ParameterSet set = factory_preset(0);
  set.period_us = 2000000;
  equal(Result::kOk, bench.call(MessageId::kCommit, CommitMessage{crc16(&set, sizeof set)}));
  bench.take(MessageId::kReadSet, bench.sequence);
  const SetReportMessage read = report<SetReportMessage>(MessageId::kSetReport, bench.sequence++);
  TEST_ASSERT_EQUAL_UINT8(0, read.pending);
  TEST_ASSERT_EQUAL_MEMORY(&set, &read.set, sizeof set);
}

void test_presets_are_saved_loaded_listed_and_forgotten_by_names_of_full_length() {
  const char name[] = "abcdefghijkl";
  Bench bench;
  bench.connect();
  SaveMessage save;
  memcpy(save.preset, name, sizeof save.preset);
  litter_the_stack();
  bench.take(MessageId::kSave, bench.sequence, save);
  bench.wait(2000);
  equal(Result::kOk, done(bench.sequence++));

  bench.take(MessageId::kPresets, bench.sequence, PresetsMessage{kFactoryPresetCount});
  const PresetReportMessage preset = report<PresetReportMessage>(MessageId::kPresetReport, bench.sequence++);
  TEST_ASSERT_EQUAL_UINT8(kFactoryPresetCount + 1, preset.count);
  TEST_ASSERT_EQUAL_UINT8(1, preset.source);
  TEST_ASSERT_EQUAL_MEMORY(name, preset.preset, sizeof preset.preset);
  bench.take(MessageId::kPresets, bench.sequence, PresetsMessage{0});
  const PresetReportMessage factory = report<PresetReportMessage>(MessageId::kPresetReport, bench.sequence++);
  TEST_ASSERT_EQUAL_UINT8(0, factory.source);
  TEST_ASSERT_EQUAL_STRING("baseline", factory.preset);
  bench.take(MessageId::kPresets, bench.sequence, PresetsMessage{99});
  const PresetReportMessage none = report<PresetReportMessage>(MessageId::kPresetReport, bench.sequence++);
  TEST_ASSERT_EQUAL_UINT8(0, none.preset[0]);

  LoadMessage load;
  memcpy(load.preset, name, sizeof load.preset);
  litter_the_stack();
  equal(Result::kOk, bench.call(MessageId::kLoad, load));
  load.preset[0] = 'x';
  equal(Result::kNoPreset, bench.call(MessageId::kLoad, load));
  ForgetMessage forget;
  memcpy(forget.preset, name, sizeof forget.preset);
  bench.take(MessageId::kForget, bench.sequence, forget);
  bench.wait(2000);
  equal(Result::kOk, done(bench.sequence++));
  memcpy(load.preset, name, sizeof load.preset);
  equal(Result::kNoPreset, bench.call(MessageId::kLoad, load));
}

/// Changes the period to one that no preset has.
uint32_t change_period(Bench& bench) {
  const uint32_t kPeriod_us = 1234000;
  equal(Result::kOk, bench.commands.set(ParameterId::kPeriodS, kPeriod_us));
  return kPeriod_us;
}

void test_defaults_and_zero_write_the_eeprom() {
  Bench bench;
  bench.connect();
  bench.wait(5000);
  bench.sums[0] = 4096 + 40;
  bench.wait(6000);
  bench.take(MessageId::kZero, bench.sequence, ZeroMessage{0});
  bench.wait(2000);
  equal(Result::kOk, done(bench.sequence++));
  TEST_ASSERT_INT16_WITHIN(40, 200, bench.controller.calibration().offset_mpsi[0]);
  bench.take(MessageId::kZero, bench.sequence, ZeroMessage{1});
  bench.wait(2000);
  equal(Result::kOk, done(bench.sequence++));
  TEST_ASSERT_EQUAL_INT16(0, bench.controller.calibration().offset_mpsi[0]);
  change_period(bench);
  bench.take(MessageId::kDefaults, bench.sequence);
  bench.wait(5000);
  equal(Result::kOk, done(bench.sequence++));
  TEST_ASSERT_EQUAL_UINT32(factory_preset(0).period_us, bench.commands.wanted().period_us);
}

void test_defaults_that_cannot_be_erased_or_are_abandoned_leave_the_set() {
  for (const bool abandoned : {false, true}) {
    Bench bench;
    bench.connect();
    const uint32_t period_us = change_period(bench);
    bench.take(MessageId::kSave, bench.sequence++, SaveMessage{{'a'}});
    bench.wait(2000);
    uint8_t worn[kEepromBytes];
    memcpy(worn, cells, sizeof cells);
    bench.take(MessageId::kDefaults, bench.sequence);
    if (abandoned) bench.connect(kKey + 1);
    sent.clear();
    for (uint16_t ms = 0; ms < 2000; ++ms) {
      if (!abandoned) memcpy(cells, worn, sizeof cells);  // no cell retains a write
      bench.wait(1);
    }
    if (!abandoned) equal(Result::kEeprom, done(bench.sequence));
    TEST_ASSERT_EQUAL_UINT32(period_us, bench.commands.wanted().period_us);
  }
}

void test_timed_holds_are_added_started_and_cleared() {
  Bench bench;
  bench.connect();
  equal(Result::kOk, bench.call(MessageId::kScheduleClear));
  equal(Result::kOk, bench.call(MessageId::kScheduleAdd, ScheduleAddMessage{70000, 1, 1}));
  equal(Result::kOrder, bench.call(MessageId::kScheduleAdd, ScheduleAddMessage{69999, 1, 0}));
  equal(Result::kTransaction, bench.call(MessageId::kScheduleStart));
  equal(Result::kOk, bench.call(MessageId::kScheduleClear));
  equal(Result::kOk, bench.call(MessageId::kScheduleAdd, ScheduleAddMessage{70000, 1, 1}));
  equal(Result::kOk, bench.call(MessageId::kScheduleStart));
  for (uint8_t second = 0; second < 69; ++second) {
    bench.wait(1000);
    bench.controller.host_heard();
  }
  bench.wait(999);
  TEST_ASSERT_EQUAL_HEX8(0, pins);
  bench.wait(5);
  TEST_ASSERT_EQUAL_HEX8(0x08, pins);
}

void test_a_session_is_guarded_and_a_bare_terminal_is_not() {
  for (const bool session : {false, true}) {
    Bench bench;
    if (session) bench.connect();
    bench.controller.hold(Chamber::kBody, ChamberState::kPositive);
    bench.wait(kSessionTimeout_ms - 10);
    TEST_ASSERT_TRUE(pins != 0);
    bench.wait(20);
    TEST_ASSERT_EQUAL(!session, pins != 0);
  }
}

void test_clock_is_the_time_and_the_marked_sample() {
  Bench bench;
  bench.connect();
  bench.wait(1234);
  equal(Result::kOk, bench.call(MessageId::kMark));
  bench.take(MessageId::kReadClock, bench.sequence);
  const ClockReportMessage clock = report<ClockReportMessage>(MessageId::kClockReport, bench.sequence);
  TEST_ASSERT_EQUAL_UINT32(1234000, clock.time_us);
  TEST_ASSERT_EQUAL_UINT16(bench.controller.marked(), clock.marked);
  TEST_ASSERT_TRUE(clock.marked > 100);
}

// ---- reports ----

void test_status_reports_every_field() {
  Bench bench;
  bench.connect();
  bench.take(MessageId::kMark, 0);
  bench.take(MessageId::kMark, 0);
  equal(Result::kOk, [&] {
    bench.sequence = 1;
    return bench.call(MessageId::kHold, HoldMessage{0, 2});
  }());
  bench.wait(500);
  bench.controller.lose_sample();
  bench.sums[0] = 4200;
  bench.sums[1] = 4300;
  bench.sums[2] = 4400;
  bench.wait(35);
  bench.take(MessageId::kStatus, 2);
  const StatusReportMessage holding = report<StatusReportMessage>(MessageId::kStatusReport, 2);
  const Status status = bench.controller.status();
  TEST_ASSERT_EQUAL_UINT8(static_cast<uint8_t>(State::kHolding), holding.state);
  TEST_ASSERT_EQUAL_UINT8(0, holding.fault);
  TEST_ASSERT_EQUAL_HEX8(0x01, holding.valves);
  TEST_ASSERT_EQUAL_UINT8(0, holding.flags);
  TEST_ASSERT_EQUAL_UINT32(535, holding.uptime_ms);
  TEST_ASSERT_EQUAL_HEX16(kCounters.frames_bad, holding.frames_bad);
  TEST_ASSERT_EQUAL_HEX16(kCounters.bytes_lost, holding.bytes_lost);
  TEST_ASSERT_EQUAL_UINT16(1, holding.frames_repeated);
  TEST_ASSERT_EQUAL_UINT16(1, holding.samples_lost);
  for (uint8_t i = 0; i < 3; ++i) {
    TEST_ASSERT_EQUAL_INT16(status.pressure_mpsi[i], holding.pressure_mpsi[i]);
    TEST_ASSERT_INT16_WITHIN(10, sensor_mpsi(bench.sums[i]), holding.pressure_mpsi[i]);
  }

  bench.sums[1] = 0;
  bench.wait(100);
  bench.take(MessageId::kStatus, 3);
  const StatusReportMessage fault = report<StatusReportMessage>(MessageId::kStatusReport, 3);
  const FaultReport& kept = bench.controller.status().fault;
  TEST_ASSERT_EQUAL_UINT8(static_cast<uint8_t>(State::kFault), fault.state);
  TEST_ASSERT_EQUAL_UINT8(static_cast<uint8_t>(Fault::kSensorRange), fault.fault);
  TEST_ASSERT_EQUAL_UINT8(1, fault.fault_channel);
  TEST_ASSERT_EQUAL_INT16(kept.value, fault.fault_value);
  TEST_ASSERT_EQUAL_INT16(kept.limit, fault.fault_limit);
  TEST_ASSERT_EQUAL_UINT32(kept.time_ms, fault.fault_time_ms);
  TEST_ASSERT_EQUAL_MEMORY(kept.lowest_mpsi, fault.fault_lowest_mpsi, sizeof kept.lowest_mpsi);
  TEST_ASSERT_EQUAL_MEMORY(kept.highest_mpsi, fault.fault_highest_mpsi, sizeof kept.highest_mpsi);
  TEST_ASSERT_TRUE(fault.fault_value < -18000 && fault.fault_limit < -15000 && fault.fault_time_ms > 535);
  TEST_ASSERT_TRUE(fault.fault_lowest_mpsi[1] < -18000 && fault.fault_highest_mpsi[2] > 1000);
  TEST_ASSERT_EQUAL_HEX8(0, fault.valves);
}

uint8_t flags_of(Bench& bench) {
  bench.take(MessageId::kStatus, bench.sequence);
  return report<StatusReportMessage>(MessageId::kStatusReport, bench.sequence++).flags;
}

void test_status_flags_a_set_that_waits_timed_holds_and_the_emergency_stop() {
  Bench bench;
  bench.connect();
  TEST_ASSERT_EQUAL_HEX8(0, flags_of(bench));
  equal(Result::kOk, bench.call(MessageId::kRun));
  bench.wait(100);
  equal(Result::kOk, bench.call(MessageId::kLoad, LoadMessage{{'o', 'b', 's', 't', 'a', 'c', 'l', 'e'}}));
  TEST_ASSERT_EQUAL_HEX8(1, flags_of(bench));
  bench.take(MessageId::kReadSet, bench.sequence);
  TEST_ASSERT_EQUAL_UINT8(1, report<SetReportMessage>(MessageId::kSetReport, bench.sequence++).pending);
  equal(Result::kOk, bench.call(MessageId::kStop));
  bench.wait(50);
  TEST_ASSERT_EQUAL_HEX8(0, flags_of(bench));
  equal(Result::kOk, bench.call(MessageId::kScheduleAdd, ScheduleAddMessage{9000, 1, 1}));
  equal(Result::kOk, bench.call(MessageId::kScheduleStart));
  TEST_ASSERT_EQUAL_HEX8(2, flags_of(bench));
  bench.pressed = true;
  bench.wait(2);
  TEST_ASSERT_EQUAL_HEX8(4, flags_of(bench));
}

void test_a_sample_travels_whole() {
  Sample sample;
  sample.sequence = 0x1234;
  sample.time_us = 0x56789ABCUL;
  sample.state = State::kHolding;
  for (uint8_t i = 0; i < 3; ++i) {
    sample.pressure_mpsi[i] = static_cast<int16_t>(-1000 * i - 7);
    sample.phase[i] = static_cast<uint16_t>(0x1111 * (i + 1));
  }
  sample.command[0] = ChamberState::kPositive;
  sample.command[1] = ChamberState::kOff;
  sample.command[2] = ChamberState::kVacuum;
  sample.valves = 0x21;
  Bench bench;
  bench.connect();
  sent.clear();
  bench.session.sample(sample);
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
  equal(Result::kOk, bench.call(MessageId::kStream, StreamMessage{1}));
  sent.clear();
  bench.session.sample(sample);
  const SampleMessage message = report<SampleMessage>(MessageId::kSample, 0x34, kStreamSeed);
  TEST_ASSERT_EQUAL_HEX16(0x1234, message.sequence);
  TEST_ASSERT_EQUAL_HEX32(0x56789ABCUL, message.time_us);
  TEST_ASSERT_EQUAL_UINT8(static_cast<uint8_t>(State::kHolding), message.state);
  TEST_ASSERT_EQUAL_MEMORY(sample.pressure_mpsi, message.pressure_mpsi, sizeof message.pressure_mpsi);
  TEST_ASSERT_EQUAL_MEMORY(sample.phase, message.phase, sizeof message.phase);
  TEST_ASSERT_EQUAL_HEX8(0x12, message.command);
  TEST_ASSERT_EQUAL_HEX8(0x21, message.valves);
  equal(Result::kOk, bench.call(MessageId::kStream, StreamMessage{0}));
  sent.clear();
  bench.session.sample(sample);
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
}

void test_a_sample_is_sent_whole_or_counted_as_lost() {
  Bench bench;
  bench.connect();
  equal(Result::kOk, bench.call(MessageId::kStream, StreamMessage{1}));
  const uint8_t frame = 2 + 1 + 2 + sizeof(SampleMessage) + 4 + 1;
  room = frame;
  sent.clear();
  bench.session.sample(Sample());
  TEST_ASSERT_EQUAL_UINT8(1, frames_sent());
  TEST_ASSERT_EQUAL(frame, sent.size());
  room = frame - 1;
  sent.clear();
  bench.session.sample(Sample());
  TEST_ASSERT_EQUAL_UINT8(0, frames_sent());
  TEST_ASSERT_EQUAL_UINT16(1, bench.controller.status().samples_lost);
}

void run() {
  RUN_TEST(test_hello_says_which_versions_which_start_and_which_session);
  RUN_TEST(test_connect_with_the_nonce_of_another_start_opens_nothing);
  RUN_TEST(test_without_a_session_no_command_is_carried_out_or_answered);
  RUN_TEST(test_the_stop_message_is_not_answered_as_a_command);
  RUN_TEST(test_a_new_session_begins_at_number_0_and_sends_no_telemetry);
  RUN_TEST(test_a_new_session_does_not_wait_for_what_an_earlier_one_saves);
  RUN_TEST(test_a_new_session_ends_timed_holds);
  RUN_TEST(test_a_repeated_command_is_answered_from_memory_and_counted);
  RUN_TEST(test_after_a_gap_it_says_which_number_it_expects_and_does_nothing);
  RUN_TEST(test_numbers_go_on_after_255);
  RUN_TEST(test_a_repeated_question_is_answered_anew);
  RUN_TEST(test_repeats_are_counted_up_to_65535);
  RUN_TEST(test_a_command_that_saves_is_answered_when_that_is_done_and_others_wait);
  RUN_TEST(test_a_save_that_fails_is_answered_so);
  RUN_TEST(test_a_zero_that_cannot_be_stored_changes_no_offset);
  RUN_TEST(test_hold_takes_its_chamber_and_its_state);
  RUN_TEST(test_clear_releases_a_stop);
  RUN_TEST(test_sets_are_begun_filled_and_committed);
  RUN_TEST(test_presets_are_saved_loaded_listed_and_forgotten_by_names_of_full_length);
  RUN_TEST(test_defaults_and_zero_write_the_eeprom);
  RUN_TEST(test_defaults_that_cannot_be_erased_or_are_abandoned_leave_the_set);
  RUN_TEST(test_timed_holds_are_added_started_and_cleared);
  RUN_TEST(test_a_session_is_guarded_and_a_bare_terminal_is_not);
  RUN_TEST(test_clock_is_the_time_and_the_marked_sample);
  RUN_TEST(test_status_reports_every_field);
  RUN_TEST(test_status_flags_a_set_that_waits_timed_holds_and_the_emergency_stop);
  RUN_TEST(test_a_sample_travels_whole);
  RUN_TEST(test_a_sample_is_sent_whole_or_counted_as_lost);
}

}  // namespace

void bifa::set_valves(ValvePattern pattern) { pins = pattern.bits(); }
void bifa::outdate_input() {}
void bifa::output(uint8_t byte) { sent += static_cast<char>(byte); }
uint8_t bifa::output_room() { return room; }
uint8_t bifa::eeprom_read(uint16_t address) { return cells[address % kEepromBytes]; }
void bifa::eeprom_write(uint16_t address, uint8_t value) {
  cells[address % kEepromBytes] = value;
  cells_busy = 4;
}
bool bifa::eeprom_busy() { return cells_busy > 0; }

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
