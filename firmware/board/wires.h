// What the board's interrupts call. main.cpp ties these to the controller and the receiver.
#pragma once

#include <stdint.h>

#include "sensor.h"

namespace board {

/// Every millisecond; other interrupts may nest. Returns whether a round of conversions begins with the next tick.
bool on_tick(bool emergency_stop_pressed);
/// Whether the strobe rises with that round.
bool strobes();
/// A byte arrived; `damaged`: its stop bit was missing, or others before it were lost. Interrupts are off.
void on_byte(uint8_t byte, bool damaged);
/// The emergency stop was pressed; interrupts are off.
void on_emergency_stop();
/// A round of conversions is complete; in the tick, before on_tick().
void on_round(const bifa::RawRound& round);

}  // namespace board
