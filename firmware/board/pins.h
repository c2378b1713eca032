// The valve pins, the emergency stop and the LED.
#pragma once

namespace board {

/// Valves off and driven; the emergency stop (D2) pulled up and watched; LED (D13) off.
void pins_begin();

/// All valve pins low, whoever calls.
void vent();

bool emergency_stop_pressed();

}  // namespace board
