// Received bytes one by one: the receiver against its own rules, the decoder against a reference implementation of
// COBS.
#include <unity.h>

#include <string>
#include <vector>

#include "../../suite.h"
#include "../cobs.h"
#include "crc.h"
#include "frame.h"
#include "output.h"
#include "receiver.h"

using namespace bifa;

namespace {

std::string sent;

uint32_t checks(const std::string& body, uint32_t seed) {
  uint16_t first = static_cast<uint16_t>(seed), second = static_cast<uint16_t>(seed >> 16);
  for (char c : body) {
    first = crc16_update(first, static_cast<uint8_t>(c));
    second = crc16_reflected_update(second, static_cast<uint8_t>(c));
  }
  return first | static_cast<uint32_t>(second) << 16;
}

std::string with_checks(std::string body, uint32_t seed) {
  const uint32_t check = checks(body, seed);
  for (uint8_t byte = 0; byte < 4; ++byte) body += static_cast<char>(check >> 8 * byte);
  return body;
}

std::string masked(std::string coded, char mask = 0x5A) {
  for (char& c : coded) c ^= mask;
  return std::string(1, mask) + coded;
}

const uint32_t kSession = 0x12345678UL;

/// Whether the decoder accepts these bytes, given without their delimiters.
bool accepts(FrameDecoder& decoder, const std::string& bytes, uint32_t session = kSession) {
  decoder.start();
  for (char c : bytes) decoder.feed(static_cast<uint8_t>(c));
  return decoder.finish(session);
}
bool accepts(const std::string& bytes) {
  FrameDecoder decoder;
  return accepts(decoder, bytes);
}

std::string body_of(MessageId message, char sequence, const std::string& fields) {
  return std::string{static_cast<char>(message), sequence} + fields;
}

// ---- the decoder ----

void test_every_message_is_decoded_whatever_its_fields() {
  uint32_t random = 1;
  FrameDecoder decoder;
  for (uint16_t number = 0; number < 0x100; ++number) {
    uint8_t size = 0;
    if (!inward_size(static_cast<uint8_t>(number), size)) continue;
    for (uint8_t turn = 0; turn < 40; ++turn) {
      std::string fields;
      for (uint8_t i = 0; i < size; ++i) {
        random = random * 1664525UL + 1013904223UL;
        fields += static_cast<char>(random >> 31 ? 0 : random >> 16);
      }
      const bool open = number < static_cast<uint8_t>(MessageId::kStatus);
      const std::string body = std::string{static_cast<char>(number), static_cast<char>(turn)} + fields;
      const uint32_t seed = open ? 0xFFFFFFFFUL : kSession;
      TEST_ASSERT_TRUE(accepts(decoder, masked(cobs(with_checks(body, seed)))));
      TEST_ASSERT_EQUAL_MEMORY(body.data(), &decoder.frame(), body.size());
      TEST_ASSERT_EQUAL(open, accepts(decoder, masked(cobs(with_checks(body, 0xFFFFFFFFUL)))));
    }
  }
}

void test_a_mask_of_any_value_is_taken_off() {
  const std::string coded = cobs(with_checks(body_of(MessageId::kRun, 7, ""), kSession));
  for (uint16_t mask = 1; mask < 0x100; ++mask) {
    TEST_ASSERT_TRUE(accepts(masked(coded, static_cast<char>(mask))));
  }
}

void test_every_wrong_bit_of_the_checks_is_seen() {
  const std::string body = with_checks(body_of(MessageId::kHold, 3, "\x01\x02"), kSession);
  for (size_t bit = 0; bit < 8 * body.size(); ++bit) {
    std::string wrong = body;
    wrong[bit / 8] ^= static_cast<char>(1 << bit % 8);
    TEST_ASSERT_FALSE(accepts(masked(cobs(wrong))));
  }
}

void test_a_message_of_another_length_than_its_own_is_refused_though_its_checks_are_right() {
  for (uint8_t size = 0; size <= 20; ++size) {
    const std::string body = body_of(MessageId::kHold, 3, std::string(size, '\x01'));
    TEST_ASSERT_EQUAL(size == 2, accepts(masked(cobs(with_checks(body, kSession)))));
  }
  TEST_ASSERT_FALSE(accepts(masked(cobs(with_checks(body_of(MessageId::kDone, 3, "\x01"), kSession)))));
}

void test_what_is_no_cobs_is_refused_though_its_checks_are_right() {
  std::string coded = cobs(with_checks(body_of(MessageId::kHold, 3, "\x01\x02"), kSession));
  TEST_ASSERT_TRUE(accepts(masked(coded)));
  ++coded[0];  // a run that does not end with the frame
  TEST_ASSERT_FALSE(accepts(masked(coded)));
  --coded[0];
  TEST_ASSERT_FALSE(accepts(masked(coded + '\x02')));  // another run, without its byte
  TEST_ASSERT_FALSE(accepts(masked(coded + '\x01')));  // one byte, 0, too many
  coded[0] = 0;                                        // 0 is not a valid length of a run
  TEST_ASSERT_FALSE(accepts(masked(coded)));
}

void test_no_frame_at_all_is_no_message() {
  TEST_ASSERT_FALSE(accepts(""));
  TEST_ASSERT_FALSE(accepts("\x5A"));
  for (size_t size = 0; size < 6; ++size) {
    TEST_ASSERT_FALSE(accepts(masked(cobs(std::string(size, '\0')))));
    TEST_ASSERT_FALSE(accepts(masked(cobs(std::string(size, '\x10')))));
  }
}

void test_a_frame_longer_than_any_is_refused_and_the_next_one_is_not() {
  FrameDecoder decoder;
  const std::string longest = with_checks(body_of(MessageId::kSave, 9, std::string(12, 'x')), kSession);
  TEST_ASSERT_TRUE(accepts(decoder, masked(cobs(longest))));
  TEST_ASSERT_FALSE(accepts(decoder, masked(cobs(longest + "y"))));
  TEST_ASSERT_FALSE(accepts(decoder, masked(cobs(longest + std::string(100, 'y')))));
  TEST_ASSERT_TRUE(accepts(decoder, masked(cobs(longest))));
  TEST_ASSERT_FALSE(accepts(decoder, masked(cobs(longest)).substr(0, 5)));
  TEST_ASSERT_TRUE(accepts(decoder, masked(cobs(longest))));
  TEST_ASSERT_FALSE(accepts(decoder, masked(cobs(longest.substr(0, longest.size() - 1) + std::string(1, '\0')))));
  TEST_ASSERT_TRUE(accepts(decoder, masked(cobs(longest))));
}

void test_nothing_is_written_beyond_a_frame_however_long_it_is() {
  struct {
    FrameDecoder decoder;
    uint8_t beyond[8];
  } memory;
  memset(memory.beyond, 0xA5, sizeof memory.beyond);
  TEST_ASSERT_FALSE(accepts(memory.decoder, masked(cobs(std::string(40, 'y')))));
  for (uint8_t byte : memory.beyond) TEST_ASSERT_EQUAL_HEX8(0xA5, byte);
}

// ---- sending ----

void test_what_is_sent_is_cobs_between_delimiters_and_as_long_as_was_said() {
  uint32_t random = 7;
  for (uint8_t size = 0; size <= kLongestOutward; ++size) {
    for (uint8_t turn = 0; turn < 8; ++turn) {
      std::string fields;
      for (uint8_t i = 0; i < size; ++i) {
        random = random * 1664525UL + 1013904223UL;
        fields += static_cast<char>(random >> 31 || turn == 0 ? 0 : random >> 16);
      }
      sent.clear();
      send_frame(MessageId::kStatusReport, turn, fields.data(), size, kSession);
      const std::string body =
          with_checks(body_of(MessageId::kStatusReport, static_cast<char>(turn), fields), kSession);
      const std::string expected = std::string(2, '\0') + cobs(body) + std::string(1, '\0');
      TEST_ASSERT_EQUAL(expected.size(), sent.size());
      TEST_ASSERT_EQUAL_MEMORY(expected.data(), sent.data(), expected.size());
      TEST_ASSERT_EQUAL(frame_room(size), sent.size());
    }
  }
}

void test_seeds_are_those_of_the_protocol() {
  TEST_ASSERT_EQUAL_HEX32(0xFFFFFFFFUL, kOpenSeed);
  TEST_ASSERT_EQUAL_HEX32(kTableHash, kStreamSeed);
  TEST_ASSERT_EQUAL_HEX32(kTableHash ^ 0xABCDABCDUL, session_seed(0xABCD));
}

// ---- the receiver ----

std::string drained(Receiver& receiver) {
  std::string bytes;
  uint8_t byte;
  while (receiver.pop(byte)) bytes += static_cast<char>(byte);
  return bytes;
}

void equal(const std::string& expected, const std::string& actual) {
  TEST_ASSERT_EQUAL(expected.size(), actual.size());
  TEST_ASSERT_EQUAL_MEMORY(expected.data(), actual.data(), expected.size());
}

void silence(Receiver& receiver, uint8_t ms) {
  for (; ms > 0; --ms) receiver.tick();
}

void test_a_frame_ends_after_more_than_twenty_milliseconds_of_silence() {
  for (uint16_t ms : {0, 19, 20, 21, 200}) {
    Receiver receiver;
    for (uint8_t byte : {0, 7}) receiver.push(byte);
    silence(receiver, static_cast<uint8_t>(ms));
    TEST_ASSERT_EQUAL(ms > 20, receiver.push('!'));
  }
  Receiver receiver;  // each byte restarts the silence
  for (uint8_t byte : {0, 7, 8, 9}) {
    receiver.push(byte);
    silence(receiver, 20);
  }
  TEST_ASSERT_FALSE(receiver.push('!'));
}

void test_silence_is_counted_without_end() {
  Receiver receiver;
  for (uint8_t byte : {0, 7}) receiver.push(byte);
  for (uint16_t ms = 0; ms < 256 + 10; ++ms) receiver.tick();
  TEST_ASSERT_TRUE(receiver.push('!'));
}

void test_a_frame_ends_at_its_greatest_length() {
  TEST_ASSERT_EQUAL_UINT8(20, kLongestFrame);  // docs/protocol.md
  for (uint8_t length = 1; length < 25; ++length) {
    Receiver receiver;
    receiver.push(0);
    for (uint8_t i = 0; i < length; ++i) receiver.push('a');
    TEST_ASSERT_EQUAL(length >= 20, receiver.push('!'));
  }
  Receiver receiver;  // its delimiter may follow
  std::string bytes = std::string(1, '\0') + std::string(20, 'a') + std::string(1, '\0') + "b";
  for (char c : bytes) receiver.push(static_cast<uint8_t>(c));
  equal(bytes, drained(receiver));
  TEST_ASSERT_TRUE(receiver.push('!'));
}

void test_the_queue_holds_127_bytes_wherever_it_begins() {
  for (uint8_t begin : {0, 1, 64, 127}) {
    Receiver receiver;
    for (uint8_t i = 0; i < begin; ++i) receiver.push('x');
    drained(receiver);
    std::string bytes;
    TEST_ASSERT_FALSE(receiver.has_input());
    for (uint8_t i = 0; i < 127; ++i) {
      bytes += static_cast<char>('0' + i % 64);
      receiver.push(static_cast<uint8_t>(bytes.back()));
      TEST_ASSERT_TRUE(receiver.has_input());
    }
    TEST_ASSERT_FALSE(receiver.overrun());
    TEST_ASSERT_EQUAL_UINT16(0, receiver.lost());
    receiver.push('y');
    TEST_ASSERT_TRUE(receiver.overrun());
    TEST_ASSERT_EQUAL_UINT16(1, receiver.lost());
    equal(bytes, drained(receiver));
  }
}

void test_after_an_overrun_nothing_is_queued_until_it_is_recovered_from() {
  Receiver receiver;
  receiver.push('a', true);
  receiver.push('b');
  TEST_ASSERT_FALSE(receiver.has_input());
  TEST_ASSERT_EQUAL_UINT16(2, receiver.lost());
  TEST_ASSERT_FALSE(receiver.recover());
  TEST_ASSERT_FALSE(receiver.overrun());
  receiver.push('c');
  equal("c", drained(receiver));
  receiver.push(0);
  receiver.push('d', true);
  TEST_ASSERT_TRUE(receiver.recover());
}

void test_lost_bytes_are_counted_up_to_65535() {
  Receiver receiver;
  receiver.push('a', true);
  for (uint32_t i = 1; i < 65534; ++i) receiver.push('b');
  TEST_ASSERT_EQUAL_UINT16(65534, receiver.lost());
  for (uint8_t i = 0; i < 3; ++i) receiver.push('b');
  TEST_ASSERT_EQUAL_UINT16(65535, receiver.lost());
}

void test_what_arrives_before_any_stop_is_not_outdated() {
  Receiver receiver;
  TEST_ASSERT_FALSE(receiver.outdated());
  receiver.push('a');
  TEST_ASSERT_FALSE(receiver.outdated());
}

void test_what_waited_is_outdated_until_its_last_byte_is_taken() {
  for (uint8_t begin : {0, 100, 126}) {
    for (uint8_t waiting : {0, 1, 5, 127}) {
      Receiver receiver;
      uint8_t byte;
      for (uint8_t i = 0; i < begin; ++i) receiver.push('x');
      drained(receiver);
      for (uint8_t i = 0; i < waiting; ++i) receiver.push('a');
      receiver.outdate();
      if (waiting < 127) receiver.push('b');
      for (uint8_t i = 0; i < waiting; ++i) {
        TEST_ASSERT_TRUE(receiver.outdated());
        receiver.pop(byte);
        TEST_ASSERT_EQUAL('a', byte);
      }
      TEST_ASSERT_FALSE(receiver.outdated());
      TEST_ASSERT_EQUAL(waiting < 127, receiver.pop(byte));
      TEST_ASSERT_FALSE(receiver.outdated());
    }
  }
}

void test_the_stop_frame_is_told_from_all_that_begin_like_it() {
  for (uint8_t length = 1; length < kStopFrameBytes; ++length) {
    Receiver receiver;
    receiver.push(0);
    for (uint8_t i = 0; i < length; ++i) TEST_ASSERT_FALSE(receiver.push(kStopFrame[i]));
    TEST_ASSERT_FALSE(receiver.push(static_cast<uint8_t>(kStopFrame[length] ^ 1)));
    for (uint8_t i = length + 1; i < kStopFrameBytes; ++i) TEST_ASSERT_FALSE(receiver.push(kStopFrame[i]));
    TEST_ASSERT_FALSE(receiver.push(0));
    receiver.push(0);
    for (uint8_t i = 0; i < kStopFrameBytes; ++i) {
      TEST_ASSERT_EQUAL(i + 1 == kStopFrameBytes, receiver.push(kStopFrame[i]));
    }
    TEST_ASSERT_FALSE(receiver.push('x'));  // once
    receiver.push(0);
    equal(std::string(1, '\0'), drained(receiver).substr(0, 1));
  }
}

void test_everything_but_stops_reaches_the_queue() {
  Receiver receiver;
  const std::string bytes = std::string("run\n") + '\0' + "ab" + '\0' + "x";
  for (char c : bytes) receiver.push(static_cast<uint8_t>(c));
  TEST_ASSERT_TRUE(receiver.push('!'));
  receiver.push('y');
  equal(bytes + "y", drained(receiver));
}

}  // namespace

static void run() {
  RUN_TEST(test_every_message_is_decoded_whatever_its_fields);
  RUN_TEST(test_a_mask_of_any_value_is_taken_off);
  RUN_TEST(test_every_wrong_bit_of_the_checks_is_seen);
  RUN_TEST(test_a_message_of_another_length_than_its_own_is_refused_though_its_checks_are_right);
  RUN_TEST(test_what_is_no_cobs_is_refused_though_its_checks_are_right);
  RUN_TEST(test_no_frame_at_all_is_no_message);
  RUN_TEST(test_a_frame_longer_than_any_is_refused_and_the_next_one_is_not);
  RUN_TEST(test_nothing_is_written_beyond_a_frame_however_long_it_is);
  RUN_TEST(test_what_is_sent_is_cobs_between_delimiters_and_as_long_as_was_said);
  RUN_TEST(test_seeds_are_those_of_the_protocol);
  RUN_TEST(test_a_frame_ends_after_more_than_twenty_milliseconds_of_silence);
  RUN_TEST(test_silence_is_counted_without_end);
  RUN_TEST(test_a_frame_ends_at_its_greatest_length);
  RUN_TEST(test_the_queue_holds_127_bytes_wherever_it_begins);
  RUN_TEST(test_after_an_overrun_nothing_is_queued_until_it_is_recovered_from);
  RUN_TEST(test_lost_bytes_are_counted_up_to_65535);
  RUN_TEST(test_what_arrives_before_any_stop_is_not_outdated);
  RUN_TEST(test_what_waited_is_outdated_until_its_last_byte_is_taken);
  RUN_TEST(test_the_stop_frame_is_told_from_all_that_begin_like_it);
  RUN_TEST(test_everything_but_stops_reaches_the_queue);
}

void bifa::output(uint8_t byte) { sent += static_cast<char>(byte); }

void setUp() {}
void tearDown() {}

RUN_SUITE(run)
