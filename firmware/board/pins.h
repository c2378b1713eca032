// The valve pins, the emergency stop and the LED.
#pragma once

namespace board {

/// Drives all valves off, enables the pull-up and interrupt of the emergency stop (D2), and turns the LED (D13) off.
void pins_begin();

/// Sets all valve pins low; may be called from anywhere.
void vent();

bool emergency_stop_pressed();

}  // namespace board
