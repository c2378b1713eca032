#include "print.h"

namespace bifa {

// One call of a virtual function instead of many: it takes 20 bytes of code each time.
__attribute__((noinline)) void print(Sink& sink, char character) { sink.write(static_cast<uint8_t>(character)); }

void print(Sink& sink, FlashText text) {
  const char* at = reinterpret_cast<const char*>(text);
  for (char c; (c = static_cast<char>(flash_byte(at))) != '\0'; ++at) print(sink, c);
}

void print(Sink& sink, const char* text) {
  for (; *text != '\0'; ++text) print(sink, *text);
}

void print_decimal(Sink& sink, uint32_t value, uint8_t decimals) {
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
  while (count > 0) print(sink, digits[--count]);
}

void print_signed(Sink& sink, int32_t value, uint8_t decimals) {
  if (value < 0) print(sink, '-');
  print_decimal(sink, value < 0 ? 0 - static_cast<uint32_t>(value) : value, decimals);
}

}  // namespace bifa
