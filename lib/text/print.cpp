#include "print.h"

#include "output.h"

namespace bifa {

namespace {

// To subtract them is six times as fast as to divide, and eight numbers make a line of telemetry.
const uint32_t kPowersOfTen[] BIFA_FLASH = {1, 10, 100, 1000, 10000, 100000, 1000000, 10000000, 100000000, 1000000000};
const uint8_t kLongPlaces = 10;
const uint8_t kShortPlaces = 5;

template <typename Number>
void print_digits(Number value, uint8_t place, uint8_t decimals) {
  bool leading = true;
  do {
    --place;
    const Number one = static_cast<Number>(flash_long(&kPowersOfTen[place]));
    char digit = '0';
    for (; value >= one; value -= one) ++digit;
    if (digit != '0' || place == decimals) leading = false;
    if (!leading) print(digit);
    if (place == decimals && value != 0) print('.');
  } while (place > decimals || value != 0);
}

}  // namespace

void print(char character) { output(static_cast<uint8_t>(character)); }

void print(FlashText text) {
  const char* at = reinterpret_cast<const char*>(text);
  for (char c; (c = static_cast<char>(flash_byte(at))) != '\0'; ++at) print(c);
}

void print(const char* text) {
  for (; *text != '\0'; ++text) print(*text);
}

void print_decimal(uint32_t value, uint8_t decimals) {
  if (value <= UINT16_MAX && decimals < kShortPlaces) {
    print_digits(static_cast<uint16_t>(value), kShortPlaces, decimals);
  } else {
    print_digits(value, kLongPlaces, decimals);
  }
}

void print_signed(int32_t value, uint8_t decimals) {
  if (value < 0) print('-');
  print_decimal(value < 0 ? 0 - static_cast<uint32_t>(value) : value, decimals);
}

}  // namespace bifa
