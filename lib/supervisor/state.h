#pragma once

#include <stdint.h>

namespace bifa {

/// What the controller is doing.
enum class State : uint8_t {
  kIdle,     ///< vented, ready
  kRunning,  ///< walking
  kHolding,  ///< chambers held as commanded
  kStopped,  ///< vented by a stop or the emergency stop, until cleared
  kFault,    ///< vented by a fault, until cleared
};

}  // namespace bifa
