// The way to the pressure regulator: MCP4725 on I2C. It takes nothing but a SupplyCode, which ends at 14 psi.
#pragma once

#include "supply.h"

namespace board {

void regulator_begin();

/// Sets the DAC's output (never its EEPROM). False: it does not answer, or the bus is stuck.
bool regulator_write(bifa::SupplyCode code);

}  // namespace board
