#include "cells.h"

#include <avr/io.h>

#include "critical.h"

namespace board {

uint8_t Cells::read(uint16_t address) {
  while (busy()) continue;
  EEAR = address;
  EECR |= 1 << EERE;
  return EEDR;
}

void Cells::write(uint16_t address, uint8_t value) {
  while (busy()) continue;
  EEAR = address;
  EEDR = value;
  const bifa::Critical guard;  // the second bit must follow the first within four cycles
  EECR = 1 << EEMPE;
  EECR = 1 << EEMPE | 1 << EEPE;
}

bool Cells::busy() { return EECR & (1 << EEPE); }

}  // namespace board
