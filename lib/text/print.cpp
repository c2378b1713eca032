#include "print.h"

#include "output.h"

namespace bifa {

void print(char character) { output(static_cast<uint8_t>(character)); }

void print(FlashText text) {
  const char* at = reinterpret_cast<const char*>(text);
  for (char c; (c = static_cast<char>(flash_byte(at))) != '\0'; ++at) print(c);
}

void print(const char* text) {
  for (; *text != '\0'; ++text) print(*text);
}

void print_decimal(uint32_t value, uint8_t decimals) {
  while (decimals > 0 && value % 10 == 0) {
    value /= 10;
    --decimals;
  }
  char digits[11];  // ten digits and a point
  uint8_t count = 0;
  for (uint8_t place = 0; value != 0 || place <= decimals; ++place) {
    if (place == decimals && place > 0) digits[count++] = '.';
    digits[count++] = static_cast<char>('0' + value % 10);
    value /= 10;
  }
  while (count > 0) print(digits[--count]);
}

void print_signed(int32_t value, uint8_t decimals) {
  if (value < 0) print('-');
  print_decimal(value < 0 ? 0 - static_cast<uint32_t>(value) : value, decimals);
}

}  // namespace bifa
