#include "sequencer.h"

namespace bifa {

ChamberState ValveSequencer::tick(ChamberState wanted) {
  if (fresh_) {
    fresh_ = false;
  } else if (elapsed_ms_ < kDwell_ms) {
    ++elapsed_ms_;
  }
  if (wanted == state_) return state_;
  if (wanted == ChamberState::kOff) {
    vent();
  } else if (state_ == ChamberState::kOff) {
    if (elapsed_ms_ < kDeadTime_ms) return state_;
    state_ = wanted;
    elapsed_ms_ = 0;
    fresh_ = true;
  } else if (elapsed_ms_ >= kDwell_ms) {
    vent();
  }
  return state_;
}

void ValveSequencer::vent() {
  if (state_ == ChamberState::kOff) return;
  state_ = ChamberState::kOff;
  elapsed_ms_ = 0;
  fresh_ = true;
}

}  // namespace bifa
