// Seeded random numbers, identical on every machine.
#pragma once

#include <stdint.h>

#include "parameters.h"

/// Marsaglia's xorshift.
class Random {
 public:
  explicit Random(uint32_t seed) : state_(seed) {}

  uint32_t bits() {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 17;
    state_ ^= state_ << 5;
    return state_;
  }
  uint32_t below(uint32_t limit) { return bits() % limit; }

 private:
  uint32_t state_;
};

inline uint32_t random_value(bifa::ParameterId id, Random& chance) {
  const bifa::ParameterDescriptor row = bifa::descriptor(id);
  return row.minimum + chance.below(row.maximum - row.minimum + 1);
}

/// A random valid set.
inline bifa::ParameterSet random_set(Random& chance) {
  bifa::ParameterSet set = {};
  for (uint8_t i = 0; i < bifa::kParameterCount; ++i) {
    const bifa::ParameterId id = static_cast<bifa::ParameterId>(i);
    bifa::put_value(set, id, random_value(id, chance));
  }
  return set;
}

/// Changes one of the parameters to another value.
inline void change_one(bifa::ParameterSet& set, Random& chance) {
  const bifa::ParameterId id = static_cast<bifa::ParameterId>(chance.below(bifa::kParameterCount));
  bifa::put_value(set, id, random_value(id, chance));
}
