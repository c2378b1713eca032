#include "supervisor.h"

namespace bifa {

void Supervisor::run() {
  if (state_ == State::kIdle) state_ = State::kRunning;
}

void Supervisor::idle() {
  if (!moves_air()) return;
  state_ = State::kIdle;
  vent();
}

void Supervisor::hold(Chamber chamber, ChamberState state) {
  if (state_ != State::kIdle && state_ != State::kHolding) return;
  wanted_.of[static_cast<uint8_t>(chamber)] = state;
  state_ = State::kIdle;
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    if (wanted_.of[i] != ChamberState::kOff) state_ = State::kHolding;
  }
  if (state_ == State::kIdle) vent();
}

void Supervisor::stop() {
  if (state_ != State::kFault) state_ = State::kStopped;
  latch();
}

void Supervisor::trip(Fault fault, uint8_t channel, int16_t value, int16_t limit, uint32_t time_ms,
                      const LastSecond& last_second) {
  if (state_ == State::kFault) return vent();
  state_ = State::kFault;
  latch();
  fault_.fault = fault;
  fault_.channel = channel;
  fault_.value = value;
  fault_.limit = limit;
  fault_.time_ms = time_ms;
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    fault_.lowest_mpsi[i] = last_second.lowest_mpsi(i);
    fault_.highest_mpsi[i] = last_second.highest_mpsi(i);
  }
}

void Supervisor::clear() {
  state_ = State::kIdle;
  fault_ = FaultReport();
}

void Supervisor::walk(uint8_t outputs) {
  if (state_ != State::kRunning) return;
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    wanted_.of[i] = outputs & 1 ? ChamberState::kPositive : ChamberState::kVacuum;
    outputs >>= 1;
  }
}

void Supervisor::tick() {
  ChamberStates now;
  for (uint8_t i = 0; i < kChamberCount; ++i) now.of[i] = sequencers_[i].tick(wanted_.of[i]);
  write(ValvePattern(now));
}

/// Vents, and marks everything sent so far as outdated: it cannot have been meant as an answer to this stop or fault.
void Supervisor::latch() {
  vent();
  outdated_ = true;
  outdate_input();
}

void Supervisor::vent() {
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    wanted_.of[i] = ChamberState::kOff;
    sequencers_[i].vent();
  }
  on_pins_ = ValvePattern();
  set_valves(on_pins_);
}

void Supervisor::write(ValvePattern pattern) {
  if (pattern == on_pins_) return;
  on_pins_ = pattern;
  set_valves(pattern);
}

}  // namespace bifa
