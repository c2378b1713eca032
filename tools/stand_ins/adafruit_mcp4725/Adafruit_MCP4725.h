// A 12-bit DAC on I2C with the calls of Adafruit's library of the same name, written from Microchip's
// datasheet DS22039 for machines that cannot download Adafruit's.
#pragma once

#include <Wire.h>
#include <stdint.h>

#define MCP4725_I2CADDR_DEFAULT (0x62)

class Adafruit_MCP4725 {
 public:
  // Returns whether a device acknowledges the address.
  bool begin(uint8_t i2c_address = MCP4725_I2CADDR_DEFAULT, TwoWire *wire = &Wire);

  // Sets the output to `output` of 4096 parts of the supply (0-4095; more is clipped). `writeEEPROM` also makes it the
  // output at power-up. The bus runs at `i2c_frequency` (Hz) for the transfer and at 100 kHz afterwards, as
  // Adafruit's does. Returns whether the device acknowledged every byte.
  bool setVoltage(uint16_t output, bool writeEEPROM, uint32_t i2c_frequency = 400000);

 private:
  TwoWire *wire_ = nullptr;
  uint8_t address_ = MCP4725_I2CADDR_DEFAULT;
};
