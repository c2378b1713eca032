// Output to the pressure regulator: MCP4725 on I2C. It accepts only a SupplyCode, which is limited to 14 psi.
#pragma once

#include "supply.h"

namespace board {

void regulator_begin();

/// Sets the DAC's output (never its EEPROM). Returns false if the DAC does not answer or the bus is stuck.
bool regulator_write(bifa::SupplyCode code);

}  // namespace board
