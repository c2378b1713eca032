// The chip's EEPROM: reads at once; a write goes on by itself for 3.4 ms.
#pragma once

#include "eeprom.h"

namespace board {

class Cells : public bifa::Eeprom {
 public:
  uint8_t read(uint16_t address) override;
  void write(uint16_t address, uint8_t value) override;
  bool busy() override;
};

}  // namespace board
