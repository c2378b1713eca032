// Numbers and texts, on this computer and in the chip, where texts are kept in flash.
#include <unity.h>

#include "../suite.h"
#include "decimal.h"
#include "output.h"
#include "parameters.h"
#include "print.h"

using namespace bifa;

void setUp() {}
void tearDown() {}

namespace {

char printed[80];
uint8_t length;

/// Clears `printed`, which collects the output from here on.
void begin_line() {
  memset(printed, 0, sizeof printed);
  length = 0;
}

void expect_decimal(const char* text, DecimalResult result, uint32_t scaled) {
  uint32_t got = 12345;
  TEST_ASSERT_EQUAL(static_cast<int>(result), static_cast<int>(parse_decimal(text, 3, 500, 60000, got)));
  TEST_ASSERT_EQUAL_UINT32(result == DecimalResult::kOk ? scaled : 12345, got);
}

}  // namespace

void bifa::output(uint8_t byte) {
  if (length < sizeof printed - 1) printed[length++] = static_cast<char>(byte);
}

static void test_decimals() {
  expect_decimal("5.7", DecimalResult::kOk, 5700);
  expect_decimal("+.5", DecimalResult::kOk, 500);
  expect_decimal("0.50049", DecimalResult::kOk, 500);
  expect_decimal("0.5005", DecimalResult::kOk, 501);
  expect_decimal("60.000000", DecimalResult::kOk, 60000);
  expect_decimal("60.0000000001", DecimalResult::kOutOfRange, 0);
  expect_decimal("0.4999999", DecimalResult::kOutOfRange, 0);
  expect_decimal("-1", DecimalResult::kOutOfRange, 0);
  expect_decimal("4294967.296", DecimalResult::kOutOfRange, 0);
  expect_decimal("99999999999999999999", DecimalResult::kOutOfRange, 0);
  const char* const nonsense[] = {"", ".", "-", "1e1", "nan", "inf", "5,7", "5..7", " 5", "5 ", "0x5"};
  for (const char* text : nonsense) expect_decimal(text, DecimalResult::kNotANumber, 0);
}

static void expect_printed(const char* expected, int32_t value, uint8_t decimals) {
  begin_line();
  print_signed(value, decimals);
  TEST_ASSERT_EQUAL_STRING(expected, printed);
}

static void test_numbers_as_text() {
  expect_printed("0", 0, 6);
  expect_printed("5.7", 5700000, 6);
  expect_printed("0.000005", 5, 6);
  expect_printed("-13", -13000, 3);
  expect_printed("-0.018", -18, 3);
  expect_printed("-2147483648", INT32_MIN, 0);
}

static void expect_places(const char* text, uint32_t value, uint8_t decimals) {
  begin_line();
  print_decimal(value, decimals, 3);
  TEST_ASSERT_EQUAL_STRING(text, printed);
}

static void test_numbers_with_three_decimals_at_least() {
  expect_places("5.700", 5700000, 6);
  expect_places("2.720001", 2720001, 6);
  expect_places("60.000", 60000000, 6);
  expect_places("0.000", 0, 4);
  expect_places("0.6535", 6535, 4);
  expect_places("0.650", 6500, 4);
  expect_places("360.000", 360000, 3);
}

static void test_phrases_are_put_in_where_their_codes_stand() {
  begin_line();
  print(text_of(ParameterId::kPsi12Deg, ParameterText::kHelp));
  TEST_ASSERT_EQUAL_STRING("phase of the head ahead of the body (psi_12)", printed);
  begin_line();
  print(text_of(ParameterId::kHostTimeoutS, ParameterText::kHelp));
  TEST_ASSERT_EQUAL_STRING("vent if the host is silent this long; 0 = never, in a session 2 s", printed);
}

static void test_texts_in_flash() {
  begin_line();
  print(BIFA_TEXT("a text in flash"));
  TEST_ASSERT_EQUAL_STRING("a text in flash", printed);
  ParameterId id;
  TEST_ASSERT_TRUE(find_parameter("duty_tail", id));
  TEST_ASSERT_EQUAL(static_cast<int>(ParameterId::kDutyTail), static_cast<int>(id));
  TEST_ASSERT_FALSE(find_parameter("duty", id));
  begin_line();
  print(text_of(ParameterId::kCouplingPerS, ParameterText::kUnit));
  TEST_ASSERT_EQUAL_STRING("1/s", printed);
}

static void test_parameters_and_presets() {
  ParameterSet set;
  TEST_ASSERT_TRUE(find_factory_preset("obstacle", set));
  TEST_ASSERT_EQUAL_UINT32(6000000, set.period_us);
  TEST_ASSERT_TRUE(is_valid(set));
  for (uint8_t i = 0; i < kParameterCount; ++i) {
    const ParameterId id = static_cast<ParameterId>(i);
    ParameterSet changed = factory_preset(0);
    put_value(changed, id, maximum_of(id));
    TEST_ASSERT_EQUAL_UINT32(maximum_of(id), value_of(changed, id));
    TEST_ASSERT_TRUE(is_valid(changed));
    put_value(changed, id, maximum_of(id) + 1);
    TEST_ASSERT_FALSE(is_valid(changed));
  }
}

static void run() {
  RUN_TEST(test_decimals);
  RUN_TEST(test_numbers_as_text);
  RUN_TEST(test_numbers_with_three_decimals_at_least);
  RUN_TEST(test_phrases_are_put_in_where_their_codes_stand);
  RUN_TEST(test_texts_in_flash);
  RUN_TEST(test_parameters_and_presets);
}
RUN_SUITE(run)
