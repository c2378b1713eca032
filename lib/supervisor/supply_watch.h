// Whether the positive supply does as it is told: the DAC answers, the regulator's monitor follows.
#pragma once

#include <stdint.h>

#include "persistence.h"

namespace bifa {

/// Failures in a row of the DAC that are borne.
const uint8_t kDacAttempts = 3;

/// The monitor's count is 0.16 psi, the regulator's linearity 1 % of 130 psi.
const int16_t kMonitorTolerance_mpsi = 3000;
/// What the board's own supply adds. The monitor's 1 to 5 V do not follow it, the DAC and the converter's reference do;
/// at 5 V (1 + e) the reading is off by 32.5 psi (1 / (1 + e) - 1), whatever the set-point: 3.6 psi at 4.5 V, the least
/// that the board works on, and -1.5 psi at 5.25 V, the most that USB gives. The chip could measure its supply only
/// against a reference that is itself known to 10 %.
const int16_t kMonitorHighAtLowSupply_mpsi = 3700;
const int16_t kMonitorLowAtHighSupply_mpsi = 1600;
/// For so long; shorter times add up, and are forgotten as fast.
const uint16_t kMonitorTime_ms = 2500;

class DacWatch {
 public:
  void told(bool answered) { failed_ = failing_.met(!answered, kDacAttempts); }
  bool failed() const { return failed_; }

 private:
  Persistence failing_;
  bool failed_ = false;
};

/// The monitor is optional. It counts as connected once it has shown its zero (1 V) or more.
class RegulatorWatch {
 public:
  /// Once a sample; returns whether the regulator has not followed for kMonitorTime_ms.
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
