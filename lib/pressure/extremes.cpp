#include "extremes.h"

namespace bifa {

void LastSecond::add(const int16_t (&pressure_mpsi)[kChamberCount]) {
  if (samples_ == kSamplesInPart || used_ == 0) {
    samples_ = 0;
    if (used_ > 0) now_ = now_ + 1 == kParts ? 0 : now_ + 1;
    if (used_ < kParts) ++used_;
  }
  Part& part = parts_[now_];
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    if (samples_ == 0 || pressure_mpsi[i] < part.lowest[i]) part.lowest[i] = pressure_mpsi[i];
    if (samples_ == 0 || pressure_mpsi[i] > part.highest[i]) part.highest[i] = pressure_mpsi[i];
  }
  ++samples_;
}

int16_t LastSecond::lowest_mpsi(uint8_t chamber) const {
  if (used_ == 0) return 0;
  int16_t lowest = INT16_MAX;
  for (uint8_t part = 0; part < used_; ++part) {
    if (parts_[part].lowest[chamber] < lowest) lowest = parts_[part].lowest[chamber];
  }
  return lowest;
}

int16_t LastSecond::highest_mpsi(uint8_t chamber) const {
  if (used_ == 0) return 0;
  int16_t highest = INT16_MIN;
  for (uint8_t part = 0; part < used_; ++part) {
    if (parts_[part].highest[chamber] > highest) highest = parts_[part].highest[chamber];
  }
  return highest;
}

}  // namespace bifa
