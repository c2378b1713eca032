#include "decimal.h"

namespace bifa {

namespace {
const uint32_t kHuge = 0xFFFFFFFFUL;

/// Appends a digit; saturates instead of wrapping.
void append(uint32_t& value, uint8_t digit) {
  const uint32_t limit = (kHuge - 9) / 10;
  value = value > limit ? kHuge : value * 10 + digit;
}
}  // namespace

DecimalResult parse_decimal(const char* text, uint8_t decimals, uint32_t minimum, uint32_t maximum, uint32_t& scaled) {
  const bool negative = *text == '-';
  if (*text == '-' || *text == '+') ++text;

  uint32_t value = 0;
  uint8_t places = 0;  // decimals read so far, up to `decimals`
  bool seen_point = false;
  bool seen_digit = false;
  bool round_up = false;  // the first digit beyond the last place is 5 or more
  bool beyond = false;    // there is something other than 0 beyond the last place
  bool first_beyond = true;
  for (; *text != '\0'; ++text) {
    if (*text == '.' && !seen_point) {
      seen_point = true;
      continue;
    }
    if (*text < '0' || *text > '9') return DecimalResult::kNotANumber;
    const uint8_t digit = *text - '0';
    seen_digit = true;
    if (!seen_point) {
      append(value, digit);
    } else if (places < decimals) {
      append(value, digit);
      ++places;
    } else {
      if (first_beyond) round_up = digit >= 5;
      first_beyond = false;
      beyond = beyond || digit != 0;
    }
  }
  if (!seen_digit) return DecimalResult::kNotANumber;
  for (; places < decimals; ++places) append(value, 0);

  if (negative && (value != 0 || beyond)) return DecimalResult::kOutOfRange;
  if (value < minimum || value > maximum || (value == maximum && beyond)) return DecimalResult::kOutOfRange;
  scaled = value + (round_up ? 1 : 0);
  return DecimalResult::kOk;
}

}  // namespace bifa
