#include "tick.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "converter.h"
#include "pins.h"
#include "start.h"
#include "wires.h"

namespace board {

namespace {

const uint16_t kCyclesPerTick = F_CPU / 1000;
const uint8_t kSetAtTick = 1 << COM1B1 | 1 << COM1B0;
const uint8_t kClearAtTick = 1 << COM1B1;

bool round_begins = false;
volatile bool under_way = false;

}  // namespace

void tick_begin() {
  OCR1A = kCyclesPerTick - 1;
  OCR1B = kCyclesPerTick - 1;
  TCNT1 = 0;
  strobe_end();
  DDRB |= 1 << PB2;
  TCCR1B = 1 << WGM12 | 1 << CS10;  // count 16 MHz up to OCR1A
  TIFR1 = 1 << OCF1A;
  TIMSK1 = 1 << OCIE1A;
}

void strobe_end() {
  TCCR1A = kClearAtTick;
  TCCR1C = 1 << FOC1B;  // force the pin low now
}

}  // namespace board

// Interrupts may nest, so that a stop byte does not wait for the oscillators.
ISR(TIMER1_COMPA_vect, ISR_NOBLOCK) {
  using namespace board;
  watchdog_tick();
  if (under_way) return;  // never re-entered, even if one hangs
  under_way = true;
  converter_tick();
  if (round_begins) converter_begin_round();
  round_begins = on_tick(emergency_stop_pressed());
  if (round_begins && strobes()) TCCR1A = kSetAtTick;
  watchdog_ticked();
  under_way = false;
}
