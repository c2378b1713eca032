// The set-point of the positive supply as sent to the regulator. It cannot be constructed above 14 psi.
#pragma once

#include <stdint.h>

#include "constants.h"

namespace bifa {

const uint16_t kGreatestSupply_mpsi = 14000;

class SupplyCode {
 public:
  /// No pressure.
  constexpr SupplyCode() : counts_(0) {}

  /// The count for a pressure, limited to that of 14 psi.
  static SupplyCode of(uint32_t pressure_mpsi) {
    if (pressure_mpsi > kGreatestSupply_mpsi) pressure_mpsi = kGreatestSupply_mpsi;
    return SupplyCode(static_cast<uint16_t>(pressure_mpsi * kConverterCounts / kRegulatorSpan_mpsi));
  }

  uint16_t counts() const { return counts_; }

 private:
  explicit SupplyCode(uint16_t counts) : counts_(counts) {}
  uint16_t counts_;
};

}  // namespace bifa
