// The valve pins, the emergency stop and the LED.
#pragma once

#include "valve_pattern.h"

namespace board {

/// D4 to D9, as the pattern has them: bits 0 to 3 on port D from bit 4, bits 4 and 5 on port B from bit 0.
class Pins : public bifa::ValvePins {
 public:
  /// Valves off and driven; the emergency stop (D2) pulled up and watched; LED (D13) off.
  void begin();
  void write(bifa::ValvePattern pattern) override;
};

/// All valve pins low, whoever calls.
void vent();

bool emergency_stop_pressed();

void light(bool on);

}  // namespace board
