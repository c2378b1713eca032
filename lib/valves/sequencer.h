// One chamber's pair of valves in time: break before make, and a least stay in each state.
#pragma once

#include "chamber.h"
#include "constants.h"

namespace bifa {

/// How long a valve stays energised at least, however short the command. Venting does not wait for it.
const uint8_t kDwell_ms = 20;

class ValveSequencer {
 public:
  /// Every millisecond, with what the chamber is to do; returns what it does.
  ChamberState tick(ChamberState wanted);

  /// Off at once.
  void vent();

  ChamberState state() const { return state_; }

 private:
  ChamberState state_ = ChamberState::kOff;
  // Ticks until the next change may come. A change may come just before a tick, so the first tick after it is one more:
  // that makes every time a lower bound.
  uint8_t rest_ = 0;
};

}  // namespace bifa
