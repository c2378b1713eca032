// Frequent phrases of texts: each is stored as one byte there, and expanded when printed.
#pragma once

#include "flash.h"

namespace bifa {

/// The code of the first phrase; the others follow consecutively (schema/phrases.py).
const uint8_t kFirstPhrase = 0x80;
/// All phrases in sequence, each zero-terminated; none contains the code of another.
extern const char kPhrases[] BIFA_FLASH;

}  // namespace bifa
