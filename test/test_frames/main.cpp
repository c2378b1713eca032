// The receiver and the decoder, on this computer and in the chip, where the CRCs use the chip's own instructions.
#include <unity.h>

#include "../suite.h"
#include "crc.h"
#include "critical.h"
#include "frame.h"
#include "output.h"
#include "receiver.h"

using namespace bifa;

void bifa::output(uint8_t) {}  // nothing is sent here

void setUp() {}
void tearDown() {}

namespace {

/// Pushes bytes; returns whether one of them was a stop.
bool push(Receiver& receiver, const uint8_t* bytes, uint8_t size) {
  bool stop = false;
  for (uint8_t i = 0; i < size; ++i) stop = receiver.push(bytes[i]) || stop;
  return stop;
}

uint8_t drain(Receiver& receiver, uint8_t* bytes) {
  uint8_t count = 0;
  while (receiver.pop(bytes[count])) ++count;
  return count;
}

}  // namespace

static void test_check_values() {
  TEST_ASSERT_EQUAL_HEX16(0x29B1, crc16("123456789", 9));
  uint16_t reflected = kCrcSeed;
  for (char c = '1'; c <= '9'; ++c) reflected = crc16_reflected_update(reflected, c);
  TEST_ASSERT_EQUAL_HEX16(0x4B37, reflected);
}

static void test_the_stop_frame_stops_at_its_last_byte() {
  Receiver receiver;
  const uint8_t delimiters[] = {0, 0};
  TEST_ASSERT_FALSE(push(receiver, delimiters, 2));
  for (uint8_t i = 0; i < kStopFrameBytes; ++i) {
    TEST_ASSERT_EQUAL(i == kStopFrameBytes - 1, receiver.push(flash_byte(&kStopFrame[i])));
  }
}

static void test_the_stop_frame_decodes_and_no_other_stops() {
  FrameDecoder decoder;
  decoder.start();
  for (uint8_t i = 0; i < kStopFrameBytes; ++i) decoder.feed(flash_byte(&kStopFrame[i]));
  TEST_ASSERT_TRUE(decoder.finish(0));
  TEST_ASSERT_EQUAL(static_cast<int>(MessageId::kStopNow), decoder.frame().message);
  for (uint8_t spoilt = 0; spoilt < kStopFrameBytes; ++spoilt) {
    Receiver receiver;
    receiver.push(0);
    bool stop = false;
    for (uint8_t i = 0; i < kStopFrameBytes; ++i) {
      stop = receiver.push(flash_byte(&kStopFrame[i]) ^ (i == spoilt ? 0x40 : 0)) || stop;
    }
    TEST_ASSERT_FALSE(stop);
  }
}

static void test_stops_outside_and_inside_frames() {
  Receiver receiver;
  const uint8_t inside[] = {0, 1, '!', 2, 0};
  TEST_ASSERT_FALSE(push(receiver, inside, sizeof inside));
  TEST_ASSERT_TRUE(receiver.push('!'));
  receiver.push(0);  // a stray delimiter
  receiver.push(1);
  TEST_ASSERT_FALSE(receiver.push('!'));
  for (uint8_t ms = 0; ms < 21; ++ms) receiver.tick();
  TEST_ASSERT_TRUE(receiver.push('!'));
  receiver.push(0);
  for (uint8_t i = 0; i < kLongestFrame; ++i) TEST_ASSERT_FALSE(receiver.push(1));
  TEST_ASSERT_TRUE(receiver.push('!'));
}

static void test_no_frame_begins_with_a_stop_so_a_stray_delimiter_does_not_hide_one() {
  Receiver receiver;
  uint8_t out[128];
  const uint8_t bytes[] = {'a', 0, '!', 'b', 0, 0, '!', 'c'};
  TEST_ASSERT_TRUE(push(receiver, bytes, 3));
  TEST_ASSERT_TRUE(push(receiver, bytes + 3, 5));
  const uint8_t expected[] = {'a', 0, 0, 'b', 0, 0, 'c'};
  TEST_ASSERT_EQUAL(sizeof expected, drain(receiver, out));
  TEST_ASSERT_EQUAL_UINT8_ARRAY(expected, out, sizeof expected);
}

// The host's stop after a frame of another message, with any single byte of the whole replaced, lost or doubled.
static void test_a_stop_survives_any_single_damaged_byte() {
  const uint8_t before[] = {0, 0, 0x02, 0x13, 0x12, 0x07, 0x44, 0x5A, 0x7E, 0x10, 0};
  uint8_t sent[sizeof before + 2 + kStopFrameBytes + 2];
  const uint8_t size = sizeof sent;
  memcpy(sent, before, sizeof before);
  sent[sizeof before] = sent[sizeof before + 1] = 0;
  flash_copy(sent + sizeof before + 2, kStopFrame, kStopFrameBytes);
  sent[size - 2] = 0;
  sent[size - 1] = '!';
  for (uint8_t place = 0; place < size; ++place) {
    for (uint16_t value = 0; value < 0x100; ++value) {  // includes its own value: undamaged
      Receiver receiver;
      bool stop = push(receiver, sent, place);
      stop = receiver.push(static_cast<uint8_t>(value)) || stop;
      stop = push(receiver, sent + place + 1, size - place - 1) || stop;
      TEST_ASSERT_TRUE(stop);
    }
    for (uint8_t doubled = 0; doubled < 2; ++doubled) {
      Receiver receiver;
      bool stop = push(receiver, sent, place + doubled);
      stop = push(receiver, sent + place + !doubled, size - place - !doubled) || stop;
      TEST_ASSERT_TRUE(stop);
    }
  }
}

static void test_in_the_queue_every_frame_stands_between_two_delimiters() {
  Receiver receiver;
  uint8_t out[128];
  const uint8_t bytes[] = {'a', 0, 0, 0, 1, 2, 0, 'b', 0, 3};
  push(receiver, bytes, sizeof bytes);
  for (uint8_t ms = 0; ms < 21; ++ms) receiver.tick();
  receiver.push('c');
  const uint8_t expected[] = {'a', 0, 1, 2, 0, 'b', 0, 3, 0, 'c'};
  TEST_ASSERT_EQUAL(sizeof expected, drain(receiver, out));
  TEST_ASSERT_EQUAL_UINT8_ARRAY(expected, out, sizeof expected);
}

static void test_an_overrun_is_told_and_ends() {
  Receiver receiver;
  uint8_t out[128];
  for (uint8_t i = 0; i < 200; ++i) receiver.push('x');
  TEST_ASSERT_TRUE(receiver.overrun());
  TEST_ASSERT_EQUAL_UINT16(73, receiver.lost());
  TEST_ASSERT_EQUAL(127, drain(receiver, out));
  TEST_ASSERT_FALSE(receiver.recover());
  receiver.push('y');
  TEST_ASSERT_EQUAL(1, drain(receiver, out));
  TEST_ASSERT_EQUAL('y', out[0]);
}

static void test_what_the_receiver_lost_or_damaged_is_counted_and_spoils_what_came_with_it() {
  Receiver receiver;
  uint8_t out[128];
  push(receiver, reinterpret_cast<const uint8_t*>("set "), 4);
  receiver.push('5', true);
  receiver.push('\n');
  TEST_ASSERT_EQUAL_UINT16(2, receiver.lost());
  TEST_ASSERT_TRUE(receiver.overrun());
  TEST_ASSERT_EQUAL(4, drain(receiver, out));
  receiver.recover();
  TEST_ASSERT_TRUE(receiver.push('!', true));
}

#ifndef __AVR__
static void test_what_the_receive_interrupt_writes_is_read_under_guard() {
  Receiver receiver;
  uint8_t byte;
  for (uint8_t i = 0; i < 3; ++i) receiver.push('x');
  receiver.outdate();
  unsigned before = Critical::entered();
  receiver.lost();
  TEST_ASSERT_EQUAL(before + 1, Critical::entered());
  receiver.pop(byte);
  TEST_ASSERT_EQUAL(before + 2, Critical::entered());
}
#endif

static void run() {
  RUN_TEST(test_check_values);
  RUN_TEST(test_the_stop_frame_stops_at_its_last_byte);
  RUN_TEST(test_the_stop_frame_decodes_and_no_other_stops);
  RUN_TEST(test_stops_outside_and_inside_frames);
  RUN_TEST(test_no_frame_begins_with_a_stop_so_a_stray_delimiter_does_not_hide_one);
  RUN_TEST(test_a_stop_survives_any_single_damaged_byte);
  RUN_TEST(test_what_the_receiver_lost_or_damaged_is_counted_and_spoils_what_came_with_it);
  RUN_TEST(test_in_the_queue_every_frame_stands_between_two_delimiters);
  RUN_TEST(test_an_overrun_is_told_and_ends);
#ifndef __AVR__
  RUN_TEST(test_what_the_receive_interrupt_writes_is_read_under_guard);
#endif
}
RUN_SUITE(run)
