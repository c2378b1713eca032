#include "start.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "pins.h"

namespace board {

namespace {

// RAM that no start-up code clears keeps information across a reset. The Uno's bootloader (Optiboot 4.4) clears MCUSR,
// and after an external reset it ends by a watchdog reset of its own, so MCUSR alone is not conclusive.
#define KEPT __attribute__((section(".noinit")))
const uint16_t kAlive = 0xA11E;
const uint16_t kHung = 0xD06E;
uint16_t life KEPT;  ///< kAlive or kHung, unless the power was off
uint16_t nonce KEPT;
bool direct_starts_show KEPT;  ///< this bootloader's wait has been seen once, so a start without it is a direct one
uint8_t flags KEPT;            ///< MCUSR
uint8_t no_wait KEPT;          ///< 0: the bootloader waited for a program just now

const uint8_t kHungAfter_ms = 200;  ///< the watchdog's nominal 0.25 s may be 0.23 to 0.32 s
volatile uint8_t unfed_ms = 0;
volatile bool ticked = false;

/// Vents and waits for the watchdog's reset.
void give_up() __attribute__((noreturn));
void give_up() {
  cli();
  vent();
  life = kHung;
  while (true) continue;
}

}  // namespace

// Runs before the C++ start-up, because after a watchdog reset the watchdog continues with its shortest time. A reset
// leaves the general registers unchanged, and these four hold constants while Optiboot 4.4 waits for a program, also if
// one arrives.
extern "C" void look_at_start() __attribute__((naked, used, section(".init3")));
extern "C" void look_at_start() {
  asm volatile(
      "ldi r24, 1    \n"
      "eor r8, r24   \n"
      "ldi r24, 0x11 \n"
      "eor r9, r24   \n"
      "ldi r24, 5    \n"
      "eor r10, r24  \n"
      "ldi r24, 3    \n"
      "eor r11, r24  \n"
      "or r8, r9     \n"
      "or r8, r10    \n"
      "or r8, r11    \n"
      "sts %0, r8    \n" ::"i"(&no_wait));
  flags = MCUSR;
  MCUSR = 0;
  wdt_disable();
}

bifa::StartCause start_cause() {
  const bool hung = life == kHung;
  const bool kept = hung || life == kAlive;
  const bool waited = no_wait == 0;
  if (!kept || waited) direct_starts_show = waited;
  life = kAlive;
  ++nonce;
  if (flags & (1 << PORF)) return bifa::StartCause::kPower;
  if (hung || (flags & (1 << WDRF))) return bifa::StartCause::kWatchdog;
  if (flags & (1 << BORF)) return bifa::StartCause::kBrownOut;
  if (flags != 0 || waited) return bifa::StartCause::kExternal;
  if (!kept) return bifa::StartCause::kPower;
  return direct_starts_show ? bifa::StartCause::kRestart : bifa::StartCause::kExternal;
}

uint16_t boot_nonce() { return nonce; }

// System reset mode: interrupt mode would wait for its interrupt, which never comes while interrupts are off.
void watchdog_begin() { wdt_enable(WDTO_250MS); }

void watchdog_feed() {
  if (!ticked) return;
  ticked = false;
  unfed_ms = 0;
  wdt_reset();
}

void watchdog_tick() {
  if (++unfed_ms >= kHungAfter_ms) give_up();
}

void watchdog_ticked() { ticked = true; }

}  // namespace board
