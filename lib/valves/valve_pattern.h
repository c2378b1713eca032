// Levels of the six valve pins. A pattern can only be constructed from chamber states, so that both valves of a chamber
// are never energised together, whatever a caller does.
#pragma once

#include "chamber.h"

namespace bifa {

class ValvePattern {
 public:
  /// All six valves off.
  constexpr ValvePattern() : bits_(0) {}

  explicit ValvePattern(const ChamberStates& states)
      : bits_(pair(states.of[0]) | pair(states.of[1]) << 2 | pair(states.of[2]) << 4) {}

  /// Bit 2i: the positive valve of chamber i; bit 2i + 1: its vacuum valve; in the order of D4 to D9.
  uint8_t bits() const { return bits_; }

  bool operator==(const ValvePattern& other) const { return bits_ == other.bits_; }

 private:
  // Any other value in the enum (from damaged RAM) means off.
  static uint8_t pair(ChamberState state) {
    return state == ChamberState::kPositive ? 1 : state == ChamberState::kVacuum ? 2 : 0;
  }

  uint8_t bits_;
};

/// Writes the pattern to the pins at once; called with interrupts off. The board defines it.
void set_valves(ValvePattern pattern);

}  // namespace bifa
