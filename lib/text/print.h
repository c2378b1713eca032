// Prints texts and numbers for the host.
#pragma once

#include "flash.h"

namespace bifa {

void print(char character);
void print(FlashText text);
void print(const char* text);
/// Prints a carriage return and a line feed, so that bare terminals start the next line at the margin; texts that
/// contain line ends have both, too.
void print_line_end();

/// Prints value / 10^decimals without trailing zeros: (5700000, 6) -> "5.7"; but always at least `least` decimals (at
/// most `decimals`): (5700000, 6, 3) -> "5.700".
void print_decimal(uint32_t value, uint8_t decimals, uint8_t least = 0);
void print_signed(int32_t value, uint8_t decimals);

inline void print_number(uint32_t value) { print_decimal(value, 0); }

}  // namespace bifa
