// Whether the positive supply does as it is told: the DAC answers, the regulator's monitor follows.
#pragma once

#include <stdint.h>

#include "persistence.h"

namespace bifa {

/// Failures in a row of the DAC that are borne.
const uint8_t kDacAttempts = 3;

/// The monitor's count is 0.16 psi, the regulator's linearity 1 % of 130 psi.
const int16_t kMonitorTolerance_mpsi = 3000;
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
  Persistence deviating_;
  bool connected_ = false;
  bool deviates_ = false;
};

}  // namespace bifa
