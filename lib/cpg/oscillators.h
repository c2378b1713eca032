// The three coupled oscillators of eq. (9), stepped once a millisecond in integers.
#pragma once

#include "gait.h"

namespace bifa {

/// Second-order Adams-Bashforth: the sines of one step are reused in the next, so that it costs three sines per step,
/// like forward Euler (the coupling is antisymmetric).
///
/// The state consists of the body's phase and the deviations of head and tail from their wanted phases relative to it:
/// only the sines of these errors are needed, and they are constant once settled. They include kHalfStep, so that their
/// upper half is rounded. The body's phase is stored half a millisecond ahead: an output holds for a millisecond and is
/// decided for its middle.
class Oscillators {
 public:
  /// Adopts a new gait; the phases continue from their present values.
  void use(const Gait& gait);

  /// Sets the phases (turns / 2^32).
  void place(uint32_t body, uint32_t head, uint32_t tail);
  /// Starts with the body at phase 0 and the others at the phases to which the coupling leads.
  void settle();

  /// Advances by one millisecond.
  void step();

  /// The outputs u of eq. (10) after the last step: bit i for chamber i, 1 is positive pressure.
  uint8_t outputs() const { return outputs_; }

  uint32_t phase(uint8_t chamber) const;

 private:
  /// Sums of sines that act on body and head; the tail's is minus their sum.
  struct Pulls {
    int16_t body;
    int16_t head;
  };

  enum class Motion : uint8_t {
    kBegins,  ///< there is no previous step, so the next one is forward Euler
    kGoesOn,
    kSettled,  ///< no pull now nor in the previous step
  };

  static Pulls pulls(uint16_t head_error, uint16_t tail_error);
  uint32_t advance(int16_t pull, int16_t last) const;
  uint32_t couple();

  uint32_t body_ = 0;  ///< half a step ahead
  uint32_t head_error_ = 0;
  uint32_t tail_error_ = 0;
  Motion motion_ = Motion::kBegins;
  Pulls last_ = {0, 0};   ///< of the previous step
  uint8_t fraction_ = 0;  ///< of body_, 1/256 of its unit
  uint8_t outputs_ = 0;
  Gait gait_ = {};
};

}  // namespace bifa
