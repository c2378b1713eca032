// Checks of the positive supply: whether the DAC answers and the regulator's monitor follows the set-point.
#pragma once

#include <stdint.h>

#include "persistence.h"

namespace bifa {

/// Consecutive failures of the DAC that are a fault.
const uint8_t kDacAttempts = 3;

/// One count of the monitor is 0.16 psi; the regulator's linearity is 1 % of 130 psi.
const int16_t kMonitorTolerance_mpsi = 3000;
/// Deviation caused by the board's own supply. The monitor's 1 to 5 V do not follow it, but the DAC and the converter's
/// reference do: at 5 V (1 + e) the reading is off by 32.5 psi (1 / (1 + e) - 1), whatever the set-point. That is 3.6
/// psi at 4.5 V, the minimum on which the board works, and -1.5 psi at 5.25 V, the USB maximum. The chip could measure
/// its supply only against a reference that is itself accurate to only 10 %.
const int16_t kMonitorHighAtLowSupply_mpsi = 3700;
const int16_t kMonitorLowAtHighSupply_mpsi = 1600;
/// Time until a fault; shorter times add up, and decay at the same rate.
const uint16_t kMonitorTime_ms = 2500;

class DacWatch {
 public:
  void told(bool answered) { failed_ = failing_.met(!answered, kDacAttempts); }
  bool failed() const { return failed_; }

 private:
  Persistence failing_;
  bool failed_ = false;
};

/// The monitor is optional. It counts as connected once it has read its zero (1 V) or more for a second.
class RegulatorWatch {
 public:
  /// Call once per sample; returns whether the regulator has failed to follow for kMonitorTime_ms.
  bool look(uint16_t conversion, uint16_t set_point_mpsi);
  bool deviates() const { return deviates_; }
  void reset() { deviating_.reset(); }

 private:
  Persistence present_;
  Accumulation deviating_;
  bool connected_ = false;
  bool deviates_ = false;
};

}  // namespace bifa
