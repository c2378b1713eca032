// Lowest and highest pressures of the last second.
#pragma once

#include "chamber.h"

namespace bifa {

/// Keeps the extremes of the last three complete thirds of a second and of the current one.
class LastSecond {
 public:
  /// Adds a sample; 100 a second.
  void add(const int16_t (&pressure_mpsi)[kChamberCount]);

  int16_t lowest_mpsi(uint8_t chamber) const;
  int16_t highest_mpsi(uint8_t chamber) const;

 private:
  static const uint8_t kParts = 4;
  static const uint8_t kSamplesInPart = 34;

  struct Part {
    int16_t lowest[kChamberCount];
    int16_t highest[kChamberCount];
  };

  Part parts_[kParts] = {};
  uint8_t used_ = 0;  ///< parts that hold something
  uint8_t now_ = 0;
  uint8_t samples_ = 0;  ///< in the part under way
};

}  // namespace bifa
