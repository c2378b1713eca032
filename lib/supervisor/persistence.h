// A condition that has to last before it counts.
#pragma once

#include <stdint.h>

namespace bifa {

/// Counts how often in a row a condition was met; one time not met and it begins anew, so that two short spikes far
/// apart never add up.
class Persistence {
 public:
  /// Returns whether the condition has now been met `needed` times in a row.
  bool met(bool condition, uint8_t needed) {
    if (!condition) {
      count_ = 0;
    } else if (count_ < needed) {
      ++count_;
    }
    return count_ >= needed;
  }

  void reset() { count_ = 0; }

 private:
  uint8_t count_ = 0;
};

}  // namespace bifa
