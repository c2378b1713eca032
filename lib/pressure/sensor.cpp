#include "sensor.h"

namespace bifa {

int16_t sensor_mpsi(uint16_t sum) {
  // p = (n + 1/2) 37.5 psi / 1024 - 18.75 psi, since a conversion n represents the middle of its step.
  const uint32_t scaled = (sum + kOversampling / 2) * 37500UL;
  return static_cast<int16_t>(static_cast<int32_t>((scaled + 512UL * kOversampling) / (1024UL * kOversampling)) -
                              18750);
}

int16_t monitor_mpsi(uint16_t conversion) {
  // p = (5 V (n + 1/2) / 1024 - 1 V) 130 psi / 4 V
  const int32_t pressure = static_cast<int32_t>((2UL * conversion + 1) * 162500UL / 2048) - 32500;
  return pressure > INT16_MAX ? INT16_MAX : static_cast<int16_t>(pressure);
}

}  // namespace bifa
