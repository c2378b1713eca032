#include "regulator.h"

#include <Adafruit_MCP4725.h>
#include <Wire.h>
#include <avr/io.h>

namespace board {

namespace {

const uint8_t kAddress = 0x62;
// A transfer takes 0.1 ms. Wire measures its time-out by Arduino's clock, except that for the end of a transfer, which it
// awaits in its interrupt, counting cycles, while a stop has to wait. So the clock runs at a sixteenth: 0.5 ms and 32 us.
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
