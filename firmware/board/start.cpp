#include "start.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "pins.h"

namespace board {

namespace {

// The Uno's bootloader clears MCUSR and ends by a watchdog reset of its own. So the watchdog, which interrupts before
// it resets, leaves this mark in RAM that no start-up code clears.
const uint16_t kHung = 0xD06E;
uint16_t mark __attribute__((section(".noinit")));
uint16_t nonce __attribute__((section(".noinit")));
uint8_t causes __attribute__((section(".noinit")));

}  // namespace

// Before the C++ start-up: after a watchdog reset the watchdog runs on with its shortest time.
extern "C" void look_at_start() __attribute__((naked, used, section(".init3")));
extern "C" void look_at_start() {
  causes = MCUSR;
  MCUSR = 0;
  wdt_disable();
}

bifa::StartCause start_cause() {
  const bool hung = mark == kHung || (causes & (1 << WDRF));
  mark = 0;
  ++nonce;
  if (causes & (1 << PORF)) return bifa::StartCause::kPower;
  if (hung) return bifa::StartCause::kWatchdog;
  if (causes & (1 << BORF)) return bifa::StartCause::kBrownOut;
  return bifa::StartCause::kExternal;
}

uint16_t boot_nonce() { return nonce; }

void watchdog_begin() {
  const uint8_t half_second = 1 << WDP2 | 1 << WDP0;
  wdt_reset();
  WDTCSR |= 1 << WDCE | 1 << WDE;
  WDTCSR = 1 << WDIF | 1 << WDIE | 1 << WDE | half_second;
}

void watchdog_feed() { wdt_reset(); }

}  // namespace board

ISR(WDT_vect) {
  board::vent();
  board::mark = board::kHung;
  while (true) continue;  // the reset follows
}
