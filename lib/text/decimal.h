// Decimal numbers between text and scaled integers, without floating point.
#pragma once

#include <stdint.h>

namespace bifa {

enum class DecimalResult : uint8_t { kOk, kNotANumber, kOutOfRange };

/// Reads `text` as a plain decimal number ("5", "-0.25", ".5") and scales it by 10^decimals, rounding half up.
/// Rejects everything else: exponents, spaces, "nan". The range is checked before rounding.
DecimalResult parse_decimal(const char* text, uint8_t decimals, uint32_t minimum, uint32_t maximum, uint32_t& scaled);

}  // namespace bifa
