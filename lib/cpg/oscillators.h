// The three coupled oscillators of eq. (9), stepped once a millisecond in integers.
#pragma once

#include "gait.h"

namespace bifa {

/// Second-order Adams-Bashforth: the sines of one step serve the next one again, so that it costs three sines a step,
/// as forward Euler does (the coupling is antisymmetric).
///
/// What is kept are the body's phase and how far head and tail are off the phases that they are to have towards it:
/// only the sines of these are needed, and settled they rest. They carry kHalfStep, so that their upper half is rounded.
/// The body's phase is kept half a millisecond ahead: an output holds for a millisecond and is decided for its middle.
class Oscillators {
 public:
  /// Takes a new gait; the phases go on from where they are.
  void use(const Gait& gait);

  /// Puts the phases (turns / 2^32).
  void place(uint32_t body, uint32_t head, uint32_t tail);
  /// Starts with the body at phase 0 and the others where the coupling would bring them.
  void settle();

  /// One millisecond.
  void step();

  /// The outputs u of eq. (10) after the last step: bit i for chamber i, 1 is positive pressure.
  uint8_t outputs() const { return outputs_; }

  uint32_t phase(uint8_t chamber) const;

 private:
  /// Sums of sines that pull at body and head; the one at the tail is what they lack to zero.
  struct Pulls {
    int16_t body;
    int16_t head;
  };

  enum class Motion : uint8_t {
    kBegins,  ///< no step has gone before: this one is Euler's
    kGoesOn,
    kSettled,  ///< nothing pulls, nor did in the step before
  };

  static Pulls pulls(uint16_t head_error, uint16_t tail_error);
  uint32_t advance(int16_t pull, int16_t last) const;
  uint32_t couple();

  uint32_t body_ = 0;  ///< half a step ahead
  uint32_t head_error_ = 0;
  uint32_t tail_error_ = 0;
  Motion motion_ = Motion::kBegins;
  Pulls last_ = {0, 0};   ///< of the step before
  uint8_t fraction_ = 0;  ///< of body_, 1/256 of its unit
  uint8_t outputs_ = 0;
  Gait gait_ = {};
};

}  // namespace bifa
