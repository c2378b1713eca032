// The chip's EEPROM: reads are immediate; a write continues in the background for 3.4 ms.
#include <avr/io.h>

#include "critical.h"
#include "eeprom.h"

namespace bifa {

uint8_t eeprom_read(uint16_t address) {
  while (eeprom_busy()) continue;
  EEAR = address;
  EECR |= 1 << EERE;
  return EEDR;
}

void eeprom_write(uint16_t address, uint8_t value) {
  while (eeprom_busy()) continue;
  EEAR = address;
  EEDR = value;
  const Critical guard;  // the second bit must follow the first within four cycles
  EECR = 1 << EEMPE;
  EECR = 1 << EEMPE | 1 << EEPE;
}

bool eeprom_busy() { return EECR & (1 << EEPE); }

}  // namespace bifa
