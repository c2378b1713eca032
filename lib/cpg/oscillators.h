// The three coupled oscillators of eq. (9), stepped once a millisecond in integers.
#pragma once

#include "gait.h"

namespace bifa {

/// Second-order Adams-Bashforth: the sines of one step serve the next one again, so that it costs three sines a step,
/// as forward Euler does (the coupling is antisymmetric).
class Oscillators {
 public:
  /// Takes a new gait; the phases go on from where they are.
  void use(const Gait& gait) {
    gait_ = gait;
    first_ = true;
  }

  /// Puts the phases (turns / 2^32) where they are asked for.
  void place(uint32_t body, uint32_t head, uint32_t tail);
  /// Starts with the body at phase 0 and the others where the coupling would bring them.
  void settle() { place(0, gait_.psi12, gait_.psi13); }

  /// One millisecond.
  void step();

  /// The output of eq. (10) as a chamber's state: u = 1 is positive pressure.
  ChamberState command(uint8_t chamber) const {
    const bool positive = phase_[chamber] >= gait_.threshold[chamber] && !gait_.never_positive[chamber];
    return positive ? ChamberState::kPositive : ChamberState::kVacuum;
  }

  uint32_t phase(uint8_t chamber) const { return phase_[chamber]; }

 private:
  uint32_t phase_[kChamberCount];
  int16_t pull_body_;  ///< sums of sines of the step before
  int16_t pull_head_;
  uint8_t fraction_ = 0;
  bool first_ = true;  ///< no step before this one has the same right-hand side: begin with Euler
  Gait gait_;
};

}  // namespace bifa
