// Constants kept in flash: on an AVR they would otherwise be copied into its 2 KB of RAM.
#pragma once

#include <stdint.h>
#include <string.h>

#ifdef __AVR__
#include <avr/pgmspace.h>
#define BIFA_FLASH PROGMEM
#else
#define BIFA_FLASH
#endif

namespace bifa {

/// A character of a text in flash: a distinct type, so that such a text cannot be read as if it were in RAM.
struct FlashChar;
/// A zero-terminated text in flash.
using FlashText = const FlashChar*;

#ifdef __AVR__
#define BIFA_TEXT(literal) (reinterpret_cast<::bifa::FlashText>(PSTR(literal)))
inline uint8_t flash_byte(const void* address) { return pgm_read_byte(address); }
inline uint16_t flash_word(const uint16_t* address) { return pgm_read_word(address); }
inline uint32_t flash_long(const uint32_t* address) { return pgm_read_dword(address); }
inline void flash_copy(void* to, const void* from, uint16_t size) { memcpy_P(to, from, size); }
inline bool flash_equal(const char* text, const char* in_flash) { return strcmp_P(text, in_flash) == 0; }
#else
#define BIFA_TEXT(literal) (reinterpret_cast<::bifa::FlashText>(literal))
inline uint8_t flash_byte(const void* address) { return *static_cast<const uint8_t*>(address); }
inline uint16_t flash_word(const uint16_t* address) { return *address; }
inline uint32_t flash_long(const uint32_t* address) { return *address; }
inline void flash_copy(void* to, const void* from, uint16_t size) { memcpy(to, from, size); }
inline bool flash_equal(const char* text, const char* in_flash) { return strcmp(text, in_flash) == 0; }
#endif

/// Text number `index` of a list of zero-terminated texts in flash.
FlashText flash_text(const char* texts, uint8_t index);

}  // namespace bifa
