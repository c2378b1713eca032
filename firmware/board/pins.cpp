#include "pins.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "valve_pattern.h"
#include "wires.h"

namespace board {

namespace {
const uint8_t kValvesOnD = 0xF0;
const uint8_t kValvesOnB = 0x03;
const uint8_t kEmergencyStop = 1 << PD2;
const uint8_t kLed = 1 << PB5;
}  // namespace

void pins_begin() {
  vent();
  DDRD |= kValvesOnD;
  DDRB |= kValvesOnB | kLed;
  DDRD &= static_cast<uint8_t>(~kEmergencyStop);
  PORTD |= kEmergencyStop;
  EICRA = (EICRA & ~(1 << ISC00)) | 1 << ISC01;  // falling edge; the tick polls the level
  EIFR = 1 << INTF0;
  EIMSK |= 1 << INT0;
}

void vent() {
  PORTD &= static_cast<uint8_t>(~kValvesOnD);
  PORTB &= static_cast<uint8_t>(~kValvesOnB);
}

bool emergency_stop_pressed() { return !(PIND & kEmergencyStop); }

}  // namespace board

/// Writes the pattern to D4 to D9: bits 0 to 3 go to port D from bit 4, bits 4 and 5 to port B from bit 0.
void bifa::set_valves(ValvePattern pattern) {
  using namespace board;
  const uint8_t bits = pattern.bits();
  PORTD = (PORTD & static_cast<uint8_t>(~kValvesOnD)) | static_cast<uint8_t>(bits << 4);
  PORTB = (PORTB & static_cast<uint8_t>(~kValvesOnB)) | bits >> 4;
}

ISR(INT0_vect) { board::on_emergency_stop(); }
