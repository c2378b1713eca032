// The three chambers and what each may be told to do.
#pragma once

#include <stdint.h>

namespace bifa {

enum class Chamber : uint8_t { kBody, kHead, kTail };
const uint8_t kChamberCount = 3;

/// The one state of a chamber's pair of valves. There is no value for "both": it cannot be said.
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
