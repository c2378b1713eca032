#include "regulator.h"

#include <Adafruit_MCP4725.h>
#include <Wire.h>
#include <avr/io.h>

namespace board {

namespace {

const uint8_t kAddress = 0x62;
// A transfer takes 0.1 ms. Wire measures its time-out by Arduino's clock, but waits for the end of a transfer in its
// interrupt by counting cycles, which delays a stop. The clock therefore runs at a sixteenth of its speed: the
// time-outs are 0.5 ms and 32 us.
const uint32_t kTimeout_us = 32;
Adafruit_MCP4725 dac;
bool begun = false;

// Arduino's clock (timer 0 at F_CPU / 64) runs only while Wire needs it, at F_CPU / 1024.
class ArduinoClock {
 public:
  ArduinoClock() {
    TCCR0B = 1 << CS02 | 1 << CS00;
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
  Wire.clearWireTimeoutFlag();
  if (!begun) begun = dac.begin(kAddress);
  return begun && dac.setVoltage(code.counts(), false) && !Wire.getWireTimeoutFlag();
}

}  // namespace board
