// Functions that the board's interrupts call. main.cpp connects them to the controller and the receiver.
#pragma once

#include <stdint.h>

#include "sensor.h"

namespace board {

/// Called every millisecond; other interrupts may nest. Returns whether a round of conversions begins at the next tick.
bool on_tick(bool emergency_stop_pressed);
/// Whether the strobe rises with that round.
bool strobes();
/// A byte arrived. `damaged`: its stop bit was missing, or bytes before it were lost. Interrupts are off.
void on_byte(uint8_t byte, bool damaged);
/// The emergency stop was pressed; interrupts are off.
void on_emergency_stop();
/// A round of conversions is complete; called in the tick, before on_tick().
void on_round(const bifa::RawRound& round);

}  // namespace board
