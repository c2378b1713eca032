// The one state machine that owns the valves. Everything that moves air goes through it.
//
//   idle -> running, holding -> idle          as commanded
//   any  -> stopped                            stop byte, emergency stop          -> idle by clear()
//   any  -> fault                              see Fault                          -> idle by clear()
//
// In idle, stopped and fault all valves are off. A fault remains a fault if a stop follows.
#pragma once

#include "extremes.h"
#include "fault.h"
#include "sequencer.h"
#include "state.h"
#include "valve_pattern.h"

namespace bifa {

/// Marks everything that the host has sent so far as older than a stop or fault, which it must not release. Called with
/// interrupts off; provided by the owner of the receive queue.
void outdate_input();

class Supervisor {
 public:
  State state() const { return state_; }
  bool is_latched() const { return state_ == State::kStopped || state_ == State::kFault; }
  bool moves_air() const { return state_ == State::kRunning || state_ == State::kHolding; }
  const FaultReport& fault() const { return fault_; }
  /// Whether the command being executed came before the last stop or fault.
  bool outdated() const { return outdated_; }
  ValvePattern valves() const { return on_pins_; }
  ChamberState wanted(uint8_t chamber) const { return wanted_.of[chamber]; }

  // Call all of these with interrupts off.

  void run();   ///< only from idle
  void idle();  ///< from running or holding; no effect in other states
  /// Only from idle or holding.
  void hold(Chamber chamber, ChamberState state);
  /// Goes to stopped (a fault remains one); the valves are off on return.
  void stop();
  /// Goes to fault, unless one is already latched; the valves are off on return.
  void trip(Fault fault, uint8_t channel, int16_t value, int16_t limit, uint32_t time_ms,
            const LastSecond& last_second);
  /// Goes to idle, only from stopped or fault.
  void clear();
  /// All commands from now on count as sent after the last stop or fault, until the next one.
  void hear_from_now_on() { outdated_ = false; }

  /// Call every millisecond with the oscillators' outputs, bit i for chamber i; obeyed only while running.
  void walk(uint8_t outputs);
  /// Call every millisecond: advances the valves towards the wanted states.
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
