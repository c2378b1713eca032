// Wiring only: which part knows which.
#include <Arduino.h>
#include <avr/sleep.h>

#include "board/cells.h"
#include "board/converter.h"
#include "board/pins.h"
#include "board/regulator.h"
#include "board/start.h"
#include "board/tick.h"
#include "board/uart.h"
#include "board/wires.h"
#include "controller.h"
#include "parameters.h"
#include "receiver.h"

namespace {

board::Pins pins;
board::Uart uart;
board::Cells cells;
bifa::Controller controller(pins);
bifa::Receiver receiver;

}  // namespace

bool board::on_tick(bool emergency_stop_pressed) {
  receiver.tick();
  return controller.tick(emergency_stop_pressed);
}
void board::on_byte(uint8_t byte) {
  if (receiver.push(byte)) controller.stop_in_interrupt();
}
void board::on_emergency_stop() { controller.stop_in_interrupt(); }
void board::on_round(const bifa::RawRound& round) { controller.converted_in_interrupt(round); }

void setup() {
  TIMSK0 = 0;
  pins.begin();
  controller.begin(board::start_cause(), bifa::factory_preset(0), bifa::Calibration());
  uart.begin();
  board::regulator_begin();
  board::converter_begin();
  board::tick_begin();
  board::watchdog_begin();
}

void loop() {
  board::watchdog_feed();
  sleep_mode();
}
