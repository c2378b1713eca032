#include "sequencer.h"

namespace bifa {

ChamberState ValveSequencer::tick(ChamberState wanted) {
  if (rest_ > 0) --rest_;
  if (wanted == state_) return state_;
  if (wanted == ChamberState::kOff) {
    vent();
  } else if (rest_ == 0) {
    if (state_ == ChamberState::kOff) {
      state_ = wanted;
      rest_ = kDwell_ms + 1;
    } else {
      vent();
    }
  }
  return state_;
}

void ValveSequencer::vent() {
  if (state_ == ChamberState::kOff) return;
  state_ = ChamberState::kOff;
  rest_ = kDeadTime_ms + 1;
}

}  // namespace bifa
