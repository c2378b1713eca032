// Prints texts and numbers into a sink.
#pragma once

#include "flash.h"
#include "sink.h"

namespace bifa {

void print(Sink& sink, char character);
void print(Sink& sink, FlashText text);
void print(Sink& sink, const char* text);

/// Prints value / 10^decimals without trailing zeros: (5700000, 6) -> "5.7".
void print_decimal(Sink& sink, uint32_t value, uint8_t decimals);
void print_signed(Sink& sink, int32_t value, uint8_t decimals);

inline void print_number(Sink& sink, uint32_t value) { print_decimal(sink, value, 0); }

}  // namespace bifa
