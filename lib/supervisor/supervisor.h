// The one state machine that owns the valves. Everything that moves air goes through it.
//
//   idle -> running, holding -> idle          as told
//   any  -> stopped                            stop byte, emergency stop          -> idle by clear()
//   any  -> fault                              see Fault                          -> idle by clear()
//
// In idle, stopped and fault all valves are off. A fault stays a fault when a stop comes on top.
#pragma once

#include "extremes.h"
#include "fault.h"
#include "sequencer.h"
#include "state.h"
#include "valve_pattern.h"

namespace bifa {

/// What the host has sent so far came before a stop or a fault and must not release it; called with interrupts off. The
/// owner of the receive queue provides it.
void outdate_input();

class Supervisor {
 public:
  State state() const { return state_; }
  bool is_latched() const { return state_ == State::kStopped || state_ == State::kFault; }
  bool moves_air() const { return state_ == State::kRunning || state_ == State::kHolding; }
  const FaultReport& fault() const { return fault_; }
  /// Whether the command at hand came before the last stop or fault.
  bool outdated() const { return outdated_; }
  ValvePattern valves() const { return on_pins_; }
  ChamberState wanted(uint8_t chamber) const { return wanted_.of[chamber]; }

  // All of these with interrupts off.

  void run();   ///< only from idle
  void idle();  ///< from running or holding; nothing in the others
  /// From idle or holding.
  void hold(Chamber chamber, ChamberState state);
  /// To stopped (a fault stays one); the valves are off on return.
  void stop();
  /// To fault, unless one stands already; the valves are off on return.
  void trip(Fault fault, uint8_t channel, int16_t value, int16_t limit, uint32_t time_ms,
            const LastSecond& last_second);
  /// Only from stopped or fault: to idle.
  void clear();
  /// All commands from now on come after the last stop or fault, until the next one.
  void hear_from_now_on() { outdated_ = false; }

  /// Every millisecond: the outputs of the oscillators, bit i for chamber i; obeyed only while running.
  void walk(uint8_t outputs);
  /// Every millisecond: moves the valves on towards what is wanted.
  void tick();

 private:
  void latch();
  void vent();
  void write(ValvePattern pattern);

  State state_ = State::kIdle;
  ChamberStates wanted_ = {{ChamberState::kOff, ChamberState::kOff, ChamberState::kOff}};
  ValveSequencer sequencers_[kChamberCount];
  ValvePattern on_pins_;
  FaultReport fault_ = {};
  volatile bool outdated_ = false;
};

}  // namespace bifa
