// The store's interface to the EEPROM. The board defines these functions.
#pragma once

#include <stdint.h>

namespace bifa {

const uint16_t kEepromBytes = 1024;

uint8_t eeprom_read(uint16_t address);
/// Starts writing one byte; call only while not eeprom_busy(). It takes 3.4 ms, during which the power may fail.
void eeprom_write(uint16_t address, uint8_t value);
/// Whether the last write is still in progress.
bool eeprom_busy();

}  // namespace bifa
