#include "regulator.h"

#include <Adafruit_MCP4725.h>
#include <Wire.h>
#include <avr/io.h>

namespace board {

namespace {

const uint8_t kAddress = 0x62;
const uint32_t kTimeout_us = 2000;  // a transfer takes 0.1 ms
Adafruit_MCP4725 dac;
bool begun = false;

// Arduino's clock (timer 0 at F_CPU / 64) runs only while Wire needs it for its time-outs: its thousand interrupts a
// second cost sleep.
class ArduinoClock {
 public:
  ArduinoClock() {
    TCCR0B = 1 << CS01 | 1 << CS00;
    TIMSK0 |= 1 << TOIE0;
  }
  ~ArduinoClock() {
    TIMSK0 &= ~(1 << TOIE0);
    TCCR0B = 0;
  }
};

}  // namespace

void regulator_begin() {
  const ArduinoClock clock;
  Wire.begin();
  Wire.setWireTimeout(kTimeout_us, true);
}

bool regulator_write(bifa::SupplyCode code) {
  const ArduinoClock clock;
  if (!begun) begun = dac.begin(kAddress);
  return begun && dac.setVoltage(code.counts(), false);
}

}  // namespace board
