// The EEPROM as the store sees it.
#pragma once

#include <stdint.h>

namespace bifa {

const uint16_t kEepromBytes = 1024;

/// Non-volatile bytes. A write takes 3.4 ms on the chip; the power may go at any moment of it.
class Eeprom {
 public:
  virtual uint8_t read(uint16_t address) = 0;
  /// Starts to write one byte; only while not busy().
  virtual void write(uint16_t address, uint8_t value) = 0;
  /// Whether the last write is still under way.
  virtual bool busy() = 0;

 protected:
  ~Eeprom() = default;
};

}  // namespace bifa
