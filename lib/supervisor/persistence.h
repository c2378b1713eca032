// Conditions that must last before they count.
#pragma once

#include <stdint.h>

namespace bifa {

/// Counts how often in a row a condition was met; the count restarts whenever it is not met, so that two short spikes
/// far apart never add up.
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

 private:
  uint8_t count_ = 0;
};

/// Leaky sum of how long a condition is met: plus `step` for each time that it is met, minus one for each time that it
/// is not.
class Accumulation {
 public:
  /// Returns whether the sum has reached `limit` (at most 255 - `step`).
  bool met(bool condition, uint8_t step, uint8_t limit) {
    if (condition) {
      if (sum_ < limit) sum_ += step;
    } else if (sum_ > 0) {
      --sum_;
    }
    return sum_ >= limit;
  }

  void reset() { sum_ = 0; }

 private:
  uint8_t sum_ = 0;
};

}  // namespace bifa
