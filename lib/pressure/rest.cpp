#include "rest.h"

namespace bifa {

namespace {
const uint8_t kShift = 5;  ///< the means have a time constant of about a third of a second
const int16_t kMoved_mpsi = 40;
}  // namespace

void Rest::add(const int16_t (&raw_mpsi)[kChamberCount]) {
  if (samples_ < kLong_samples) ++samples_;
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    const int16_t mean_mpsi = static_cast<int16_t>(sums_[i] >> kShift);
    // The difference from one rail to the other does not fit 16 bits.
    sums_[i] += static_cast<int32_t>(raw_mpsi[i]) - mean_mpsi;
    const int32_t moved_mpsi = static_cast<int32_t>(mean_mpsi) - place_[i];
    if (moved_mpsi <= kMoved_mpsi && moved_mpsi >= -kMoved_mpsi) continue;
    place_[i] = mean_mpsi;
    samples_ = 0;
  }
}

int16_t Rest::mean_mpsi(uint8_t chamber) const {
  return static_cast<int16_t>((sums_[chamber] + (1 << (kShift - 1))) >> kShift);
}

}  // namespace bifa
