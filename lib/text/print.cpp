#include "print.h"

#include "output.h"
#include "phrases.h"

namespace bifa {

namespace {

// Subtracting these is six times as fast as dividing, and a line of telemetry has eight numbers.
const uint32_t kLong[] BIFA_FLASH = {1, 10, 100, 1000, 10000, 100000, 1000000, 10000000, 100000000, 1000000000};
const uint16_t kShort[] BIFA_FLASH = {1, 10, 100, 1000, 10000};
inline uint32_t flash_number(const uint32_t* address) { return flash_long(address); }
inline uint16_t flash_number(const uint16_t* address) { return flash_word(address); }

template <typename Number, uint8_t kPlaces>
void print_digits(Number value, uint8_t decimals, uint8_t last, const Number (&powers)[kPlaces]) {
  bool leading = true;
  uint8_t place = kPlaces;
  do {
    --place;
    const Number one = flash_number(&powers[place]);
    char digit = '0';
    for (; value >= one; value -= one) ++digit;
    if (digit != '0' || place == decimals) leading = false;
    if (!leading) print(digit);
    if (place == decimals && (place > last || value != 0)) print('.');
  } while (place > last || value != 0);
}

/// Prints text from flash up to the next phrase or the end, and returns that position.
const char* print_plain(const char* at) {
  for (uint8_t c; (c = flash_byte(at)) != '\0' && c < kFirstPhrase; ++at) print(static_cast<char>(c));
  return at;
}

}  // namespace

void print(char character) { output(static_cast<uint8_t>(character)); }

void print_line_end() {
  print('\r');
  print('\n');
}

void print(FlashText text) {
  const char* at = print_plain(reinterpret_cast<const char*>(text));
  while (flash_byte(at) != '\0') {
    print_plain(reinterpret_cast<const char*>(flash_text(kPhrases, flash_byte(at) - kFirstPhrase)));
    at = print_plain(at + 1);
  }
}

void print(const char* text) {
  for (; *text != '\0'; ++text) print(*text);
}

void print_decimal(uint32_t value, uint8_t decimals, uint8_t least) {
  const uint8_t last = decimals - least;  // the place that is printed even if only zeros follow
  if (value <= UINT16_MAX && decimals < sizeof kShort / sizeof *kShort) {
    print_digits(static_cast<uint16_t>(value), decimals, last, kShort);
  } else {
    print_digits(value, decimals, last, kLong);
  }
}

void print_signed(int32_t value, uint8_t decimals) {
  if (value < 0) print('-');
  print_decimal(value < 0 ? 0 - static_cast<uint32_t>(value) : value, decimals);
}

}  // namespace bifa
