// The three chambers and the states that each can be commanded to.
#pragma once

#include <stdint.h>

namespace bifa {

enum class Chamber : uint8_t { kBody, kHead, kTail };
const uint8_t kChamberCount = 3;

/// The state of a chamber's pair of valves. There is no value for "both", so it cannot be expressed.
enum class ChamberState : uint8_t {
  kOff,       ///< both valves de-energised: the chamber vents
  kVacuum,    ///< u = 0
  kPositive,  ///< u = 1
};

/// A state for each chamber.
struct ChamberStates {
  ChamberState of[kChamberCount];
};

}  // namespace bifa
