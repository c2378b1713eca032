// The set-point of the positive supply, on its way to the regulator. There is no way to make one above 14 psi.
#pragma once

#include <stdint.h>

namespace bifa {

/// Full scale of the SMC ITV1050 (0.9 MPa at 5 V) on the 12-bit MCP4725 would burst pouches and sensors.
const uint32_t kRegulatorSpan_mpsi = 130000;
const uint16_t kGreatestSupply_mpsi = 14000;

class SupplyCode {
 public:
  /// No pressure.
  constexpr SupplyCode() : counts_(0) {}

  /// The count for a pressure, at most that for 14 psi.
  static SupplyCode of(uint32_t pressure_mpsi) {
    if (pressure_mpsi > kGreatestSupply_mpsi) pressure_mpsi = kGreatestSupply_mpsi;
    return SupplyCode(static_cast<uint16_t>(pressure_mpsi * 4096 / kRegulatorSpan_mpsi));
  }

  uint16_t counts() const { return counts_; }

 private:
  explicit SupplyCode(uint16_t counts) : counts_(counts) {}
  uint16_t counts_;
};

}  // namespace bifa
