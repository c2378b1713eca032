// Timing of one chamber's pair of valves: break before make, and a minimum dwell time in each state.
#pragma once

#include "chamber.h"
#include "constants.h"

namespace bifa {

/// Minimum time that a valve stays energised, however short the command. Venting does not wait for it.
const uint8_t kDwell_ms = 20;

class ValveSequencer {
 public:
  /// Call every millisecond with the wanted state; returns the actual state.
  ChamberState tick(ChamberState wanted);

  /// Switches off at once.
  void vent();

  ChamberState state() const { return state_; }

 private:
  ChamberState state_ = ChamberState::kOff;
  // Ticks until the next change is allowed. A change may occur just before a tick, so one more tick is counted: every
  // time is then a lower bound.
  uint8_t rest_ = 0;
};

}  // namespace bifa
