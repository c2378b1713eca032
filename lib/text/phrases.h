// Phrases that stand often in texts: there each is one byte, and is put in when it is printed.
#pragma once

#include "flash.h"

namespace bifa {

/// The code of the first phrase; those of the others follow (schema/phrases.py).
const uint8_t kFirstPhrase = 0x80;
/// One after the other, each ended by a zero; none holds the code of another.
extern const char kPhrases[] BIFA_FLASH;

}  // namespace bifa
