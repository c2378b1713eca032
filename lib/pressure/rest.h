// Whether the pressures are at rest, and at which values.
#pragma once

#include "chamber.h"

namespace bifa {

/// Slow means of the raw pressures, and how long they have not moved.
class Rest {
 public:
  /// Begins again: what has been steady so far does not count.
  void restart() { samples_ = 0; }
  /// Adds a sample; 100 a second.
  void add(const int16_t (&raw_mpsi)[kChamberCount]);

  /// Whether no mean has moved by more than 0.04 psi, a count of the converter, for 4 s.
  bool is_long() const { return samples_ >= kLong_samples; }
  int16_t mean_mpsi(uint8_t chamber) const;

 private:
  static const uint16_t kLong_samples = 400;

  int32_t sums_[kChamberCount] = {};   ///< the means, mpsi * 2^kShift
  int16_t place_[kChamberCount] = {};  ///< where the means have rested for `samples_` samples
  uint16_t samples_ = 0;
};

}  // namespace bifa
