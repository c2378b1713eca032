// Connects the parts to one another; contains no other logic.
#include <avr/interrupt.h>
#include <avr/sleep.h>

#include "board/converter.h"
#include "board/pins.h"
#include "board/regulator.h"
#include "board/start.h"
#include "board/tick.h"
#include "board/uart.h"
#include "board/wires.h"
#include "controller.h"
#include "host_port.h"

namespace {

bifa::Controller controller;
bifa::HostPort port(controller);

const uint16_t kSupplyEvery_ms = 100;

/// Set when the main loop may have something to do: a byte arrived, or time passed. Otherwise it would run after every
/// tick, conversion and sent byte, some thousand times a second for nothing.
volatile bool attend = true;
/// How often the main loop runs without a byte: about as often as the EEPROM can accept one.
const uint8_t kAttendEvery_ms = 5;

/// Sends the regulator its set-point when it has changed, and repeats it periodically.
void tell_supply() {
  static uint16_t told = 0xFFFF;
  static uint32_t told_ms = 0;
  const bifa::SupplyCode code = controller.supply();
  const uint32_t now_ms = controller.uptime_ms();
  if (code.counts() == told && now_ms - told_ms < kSupplyEvery_ms) return;
  told = code.counts();
  told_ms = now_ms;
  controller.supply_told(board::regulator_write(code));
}

}  // namespace

bool board::on_tick(bool emergency_stop_pressed) {
  static uint8_t until_attend = kAttendEvery_ms;
  if (--until_attend == 0) {
    until_attend = kAttendEvery_ms;
    attend = true;
  }
  port.tick_in_interrupt();
  return controller.tick(emergency_stop_pressed);
}
bool board::strobes() { return controller.strobes(); }
void board::on_byte(uint8_t byte, bool damaged) {
  attend = true;
  port.byte_in_interrupt(byte, damaged);
}
void board::on_emergency_stop() { controller.stop_in_interrupt(); }
void board::on_round(const bifa::RawRound& round) { controller.converted_in_interrupt(round); }
void bifa::outdate_input() { port.outdate(); }

/// Replaces Arduino's main(), which would set up three timers for PWM and the converter, all unused here.
int main() {
  board::pins_begin();
  board::uart_begin();
  sleep_enable();  // permanently: doing it at each of a hundred wake-ups per sample would cost too much
  sei();
  const bifa::StartCause cause = board::start_cause();
  port.begin(board::boot_nonce(), cause);
  board::regulator_begin();
  board::converter_begin();
  board::tick_begin();
  board::watchdog_begin();
  while (true) {
    while (!attend) sleep_cpu();  // an interrupt between test and sleep costs at most a tick
    attend = false;
    board::watchdog_feed();
    port.poll();
    tell_supply();
    if (port.has_input()) attend = true;
  }
}
