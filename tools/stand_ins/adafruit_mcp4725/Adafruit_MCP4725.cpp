#include "Adafruit_MCP4725.h"

namespace {
const uint16_t kFullScale = 4095;
const uint32_t kStandardFrequencyHz = 100000;
const uint8_t kWriteDacAndEeprom = 0x60;  // DS22039, table 6-2: C2 C1 C0 = 0 1 1, PD1 PD0 = 0 0
}  // namespace

bool Adafruit_MCP4725::begin(uint8_t i2c_address, TwoWire *wire) {
  wire_ = wire;
  address_ = i2c_address;
  wire_->begin();
  wire_->beginTransmission(address_);
  return wire_->endTransmission() == 0;
}

bool Adafruit_MCP4725::setVoltage(uint16_t output, bool writeEEPROM, uint32_t i2c_frequency) {
  if (wire_ == nullptr) return false;
  if (output > kFullScale) output = kFullScale;
  wire_->setClock(i2c_frequency);
  wire_->beginTransmission(address_);
  if (writeEEPROM) {  // DS22039, figure 6-2: command, D11-D4, D3-D0 left-aligned
    wire_->write(kWriteDacAndEeprom);
    wire_->write(static_cast<uint8_t>(output >> 4));
    wire_->write(static_cast<uint8_t>((output & 0x0F) << 4));
  } else {  // DS22039, figure 6-1, fast mode: command 0 0 and normal power-down bits in the high nibble
    wire_->write(static_cast<uint8_t>(output >> 8));
    wire_->write(static_cast<uint8_t>(output & 0xFF));
  }
  const bool acknowledged = wire_->endTransmission() == 0;
  wire_->setClock(kStandardFrequencyHz);
  return acknowledged;
}
