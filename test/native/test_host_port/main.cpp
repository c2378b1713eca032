// All of lib/ behind its serial port: lines and frames, commands that are waiting when a stop arrives, a new session.
#include <unity.h>

#include <string>

#include "../../suite.h"
#include "../cobs.h"
#include "crc.h"
#include "host_port.h"
#include "output.h"

using namespace bifa;

namespace {

const uint16_t kNonce = 7;
const uint16_t kKey = 0x1234;

uint8_t pins = 0;
std::string sent;
uint8_t room = 127;  ///< for telemetry
uint8_t cells[kEepromBytes];
uint8_t cells_busy = 0;  ///< for this many milliseconds

/// The board: advances by a millisecond at a time; its converter answers immediately.
struct Bench {
  Controller controller;
  HostPort port;
  uint8_t sequence = 0;
  uint8_t turn = 0;

  Bench() : port(controller) {
    running = this;
    pins = cells_busy = 0;
    room = 127;
    memset(cells, 0xFF, sizeof cells);
    port.begin(kNonce, StartCause::kPower);
    sent.clear();
  }

  static Bench* running;

  void tick(uint32_t times = 1) {
    for (; times > 0; --times) {
      if (cells_busy > 0) --cells_busy;
      port.tick_in_interrupt();
      if (!controller.tick(false)) continue;
      const uint16_t alive = static_cast<uint16_t>(512 * kOversampling + turn++ % 2);
      controller.converted_in_interrupt({{alive, alive, alive}, 0});
    }
  }
  void wait(uint32_t ms) {
    for (; ms > 0; --ms) {
      tick();
      port.poll();
    }
  }
  void arrive(const std::string& bytes) {
    uint8_t count = 0;
    for (char byte : bytes) {
      port.byte_in_interrupt(static_cast<uint8_t>(byte));
      if (++count % 16 == 0) port.poll();
    }
  }
  /// Sends a line and returns the printed answer.
  std::string say(const std::string& line) {
    sent.clear();
    arrive(line + "\n");
    wait(20);
    return sent;
  }
  void connect(uint16_t key = kKey) {
    const ConnectMessage fields = {kNonce, key};
    arrive(frame(MessageId::kConnect, 0, kOpenSeed, &fields, sizeof fields));
    wait(2);
    sequence = 0;
  }
  /// The next command of the session, as transmitted.
  std::string command(MessageId message, const void* fields = nullptr, uint8_t size = 0) {
    return frame(message, sequence++, session_seed(kKey), fields, size);
  }
  void hold_at(uint32_t time_ms, Chamber chamber, ChamberState state) {
    const ScheduleAddMessage fields = {time_ms, static_cast<uint8_t>(chamber), static_cast<uint8_t>(state)};
    arrive(command(MessageId::kScheduleAdd, &fields, sizeof fields));
    wait(2);
  }

  static std::string frame(MessageId message, uint8_t sequence, uint32_t seed, const void* fields, uint8_t size);
};

Bench* Bench::running = nullptr;

/// COBS under the smallest mask that leaves neither a delimiter nor a `!`.
std::string Bench::frame(MessageId message, uint8_t sequence, uint32_t seed, const void* fields, uint8_t size) {
  std::string body = {static_cast<char>(message), static_cast<char>(sequence)};
  body.append(static_cast<const char*>(fields), size);
  uint16_t first = static_cast<uint16_t>(seed), second = static_cast<uint16_t>(seed >> 16);
  for (char c : body) {
    first = crc16_update(first, static_cast<uint8_t>(c));
    second = crc16_reflected_update(second, static_cast<uint8_t>(c));
  }
  for (uint16_t check : {first, second}) {
    body += static_cast<char>(check);
    body += static_cast<char>(check >> 8);
  }
  std::string coded = cobs(body);
  char mask = 1;
  while (coded.find(mask) != std::string::npos || coded.find(static_cast<char>(mask ^ '!')) != std::string::npos)
    ++mask;
  for (char& c : coded) c ^= mask;
  return std::string(2, '\0') + mask + coded + std::string(1, '\0');
}

bool said(const std::string& text, const std::string& what) { return text.find(what) != std::string::npos; }

/// The body of the last frame: number, sequence, fields, checks.
std::string last_frame(const std::string& bytes) {
  const size_t end = bytes.rfind('\0'), begin = bytes.rfind('\0', end - 1) + 1;
  std::string body;
  for (size_t at = begin; at < end;) {
    const uint8_t run = static_cast<uint8_t>(bytes[at]);
    body += bytes.substr(at + 1, run - 1);
    at += run;
    if (at < end) body += '\0';
  }
  return body;
}
void result_is(Result expected, const std::string& bytes) {
  const std::string body = last_frame(bytes);
  TEST_ASSERT_EQUAL_HEX8(static_cast<uint8_t>(MessageId::kDone), body[0]);
  TEST_ASSERT_EQUAL_UINT8(static_cast<uint8_t>(expected), body[2]);
}

// ---- commands that are waiting when a stop arrives ----

void test_a_clear_that_comes_behind_a_stop_is_carried_out_whatever_waits_before_it() {
  Bench bench;
  bench.connect();
  bench.arrive(bench.command(MessageId::kStatus));
  bench.arrive("!");
  bench.arrive(bench.command(MessageId::kClear));
  bench.port.poll();
  bench.wait(5);
  TEST_ASSERT_TRUE(bench.controller.state() == State::kIdle);
}

void test_a_clear_that_waits_when_a_stop_comes_is_refused_whatever_comes_after_it() {
  Bench bench;
  bench.connect();
  bench.arrive(bench.command(MessageId::kClear));
  bench.arrive("!");
  bench.arrive(bench.command(MessageId::kStatus));
  bench.port.poll();
  bench.wait(5);
  TEST_ASSERT_TRUE(bench.controller.state() == State::kStopped);
}

// ---- a typed stop ----

void test_a_line_that_arrived_damaged_stops_if_it_ends_in_stop() {
  for (const char* line : {"\x93w\x81stop", "stop\x80", "abcstop\x01", "\xFF stop ", "\x80sstop", "\x80stostop"}) {
    Bench bench;
    bench.say("run");
    TEST_ASSERT_TRUE(pins != 0);
    const std::string answer = bench.say(line);
    TEST_ASSERT_TRUE(said(answer, "ok"));
    TEST_ASSERT_EQUAL_HEX8(0, pins);
  }
}

void test_a_line_that_is_too_long_stops_if_it_ends_in_stop() {
  Bench bench;
  bench.say("run");
  TEST_ASSERT_TRUE(said(bench.say(std::string(200, 'x') + " stop"), "ok"));
  TEST_ASSERT_EQUAL_HEX8(0, pins);
}

void test_other_lines_that_arrived_damaged_are_answered_so_and_do_nothing() {
  for (const char* line : {"\x80run", "\x80", "\x80stop run", "\x80stopp", "\x80st", "run\x80"}) {
    Bench bench;
    TEST_ASSERT_TRUE(said(bench.say(line), "error the line arrived damaged"));
    TEST_ASSERT_EQUAL_HEX8(0, pins);
  }
  Bench bench;
  TEST_ASSERT_TRUE(said(bench.say(std::string(64, 'x')), "error the line exceeds 63 characters"));
  TEST_ASSERT_TRUE(said(bench.say("xstop"), "error no such command"));  // an undamaged line is taken literally
}

void test_a_stop_is_carried_out_behind_a_frame_that_was_torn() {
  Bench bench;
  bench.connect();
  bench.say("run");
  const std::string torn = bench.command(MessageId::kStatus);
  bench.arrive(torn.substr(0, 5));
  bench.wait(30);
  bench.arrive(torn.substr(5));
  bench.wait(30);
  TEST_ASSERT_TRUE(said(bench.say("stop"), "ok"));
  TEST_ASSERT_TRUE(bench.controller.state() == State::kIdle);
}

// A blank is one bit away from a delimiter, behind which the rest of the line is taken for a frame.
void test_a_line_whose_end_a_stray_delimiter_took_is_not_carried_out() {
  Bench bench;
  bench.arrive(std::string("save\0fast\n", 10));
  bench.wait(100);
  TEST_ASSERT_TRUE(said(bench.say(""), "error the line arrived damaged"));
  TEST_ASSERT_EQUAL(0xFF, cells[0]);
  TEST_ASSERT_TRUE(said(bench.say("status"), "idle"));
}

// ---- a new session ----

void test_a_new_session_ends_the_timed_holds_of_an_earlier_one() {
  Bench bench;
  bench.connect();
  bench.hold_at(0, Chamber::kBody, ChamberState::kPositive);
  bench.hold_at(500, Chamber::kHead, ChamberState::kVacuum);
  bench.arrive(bench.command(MessageId::kScheduleStart));
  bench.wait(50);
  TEST_ASSERT_EQUAL_HEX8(0x01, pins);
  bench.connect(kKey + 1);
  TEST_ASSERT_EQUAL_HEX8(0, pins);
  bench.wait(1000);
  TEST_ASSERT_EQUAL_HEX8(0, pins);
}

void test_a_new_session_does_not_commit_what_an_earlier_one_began() {
  Bench bench;
  bench.connect();
  bench.arrive(bench.command(MessageId::kBegin));
  bench.wait(2);
  bench.connect();
  ParameterSet set = factory_preset(0);
  const CommitMessage fields = {crc16(&set, sizeof set)};
  sent.clear();
  bench.arrive(bench.command(MessageId::kCommit, &fields, sizeof fields));
  bench.wait(2);
  result_is(Result::kTransaction, sent);
}

void test_a_connect_of_another_start_opens_nothing() {
  Bench bench;
  bench.connect();
  bench.hold_at(100, Chamber::kBody, ChamberState::kPositive);
  bench.arrive(bench.command(MessageId::kScheduleStart));
  bench.wait(2);
  const ConnectMessage fields = {kNonce + 1, 0x4321};
  bench.arrive(Bench::frame(MessageId::kConnect, 0, kOpenSeed, &fields, sizeof fields));
  bench.wait(120);
  TEST_ASSERT_EQUAL_HEX8(0x01, pins);
}

// ---- telemetry without room in the output ----

std::string samples_lost(Bench& bench) {
  const std::string status = bench.say("status");
  const size_t at = status.find("samples lost ") + 13;
  return status.substr(at, status.find('\r', at) - at);
}

void test_samples_that_could_not_be_sent_are_counted_alike_as_text_and_as_frames() {
  Bench text;
  text.say("stream on");
  room = 0;
  text.wait(100);
  room = 127;
  TEST_ASSERT_EQUAL_STRING("10", samples_lost(text).c_str());

  Bench frames;
  frames.connect();
  const StreamMessage on = {1};
  frames.arrive(frames.command(MessageId::kStream, &on, sizeof on));
  frames.wait(20);
  room = 0;
  frames.wait(100);
  room = 127;
  TEST_ASSERT_EQUAL_STRING("10", samples_lost(frames).c_str());
}

void test_without_a_stream_no_sample_is_lost() {
  Bench bench;
  room = 0;
  bench.wait(100);
  TEST_ASSERT_EQUAL_STRING("0", samples_lost(bench).c_str());
}

void run() {
  RUN_TEST(test_a_clear_that_comes_behind_a_stop_is_carried_out_whatever_waits_before_it);
  RUN_TEST(test_a_clear_that_waits_when_a_stop_comes_is_refused_whatever_comes_after_it);
  RUN_TEST(test_a_line_that_arrived_damaged_stops_if_it_ends_in_stop);
  RUN_TEST(test_a_line_that_is_too_long_stops_if_it_ends_in_stop);
  RUN_TEST(test_other_lines_that_arrived_damaged_are_answered_so_and_do_nothing);
  RUN_TEST(test_a_stop_is_carried_out_behind_a_frame_that_was_torn);
  RUN_TEST(test_a_line_whose_end_a_stray_delimiter_took_is_not_carried_out);
  RUN_TEST(test_a_new_session_ends_the_timed_holds_of_an_earlier_one);
  RUN_TEST(test_a_new_session_does_not_commit_what_an_earlier_one_began);
  RUN_TEST(test_a_connect_of_another_start_opens_nothing);
  RUN_TEST(test_samples_that_could_not_be_sent_are_counted_alike_as_text_and_as_frames);
  RUN_TEST(test_without_a_stream_no_sample_is_lost);
}

}  // namespace

void bifa::set_valves(ValvePattern pattern) { pins = pattern.bits(); }
void bifa::outdate_input() { Bench::running->port.outdate(); }
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
