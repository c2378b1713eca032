// The EEPROM as the store sees it. The board provides these.
#pragma once

#include <stdint.h>

namespace bifa {

const uint16_t kEepromBytes = 1024;

uint8_t eeprom_read(uint16_t address);
/// Starts to write one byte; only while not eeprom_busy(). It takes 3.4 ms; the power may go at any moment of it.
void eeprom_write(uint16_t address, uint8_t value);
/// Whether the last write is still under way.
bool eeprom_busy();

}  // namespace bifa
