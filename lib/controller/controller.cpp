#include "controller.h"

#include "critical.h"

namespace bifa {

namespace {

const uint8_t kPhaseShift = 16;
const uint16_t kSilenceUnit_ms = 10;

}  // namespace

// ---- main loop ----

void Controller::begin(StartCause cause, const ParameterSet& set, const Calibration& calibration) {
  apply(set);
  calibrate(calibration);
  if (cause == StartCause::kPower || cause == StartCause::kExternal) return;
  const Fault fault = cause == StartCause::kWatchdog   ? Fault::kWatchdog
                      : cause == StartCause::kBrownOut ? Fault::kBrownOut
                                                       : Fault::kRestart;
  trip(fault, kNoChannel, 0, 0);
}

Verdict Controller::run() {
  const Critical guard;
  if (supervisor_.is_latched()) return Verdict::kLatched;
  if (supervisor_.state() != State::kIdle || schedule_.running()) return Verdict::kRefused;
  oscillators_.settle();
  host_silence_ms_ = 0;
  supervisor_.run();
  return Verdict::kDone;
}

Verdict Controller::stop() {
  const Critical guard;
  schedule_.stop();
  supervisor_.idle();
  return Verdict::kDone;
}

Verdict Controller::hold(Chamber chamber, ChamberState state) {
  const Critical guard;
  if (supervisor_.is_latched()) return Verdict::kLatched;
  if (supervisor_.state() == State::kRunning) return Verdict::kRefused;
  host_silence_ms_ = 0;
  supervisor_.hold(chamber, state);
  return Verdict::kDone;
}

Verdict Controller::clear() {
  const Critical guard;
  if (emergency_stop_ || cause_stands()) return Verdict::kCauseStands;
  if (!supervisor_.is_latched()) return Verdict::kDone;  // the watches keep their counts
  if (supervisor_.outdated()) return Verdict::kLatched;
  schedule_.stop();
  supervisor_.clear();
  for (uint8_t i = 0; i < kChamberCount; ++i) sensors_[i].reset();
  regulator_.reset();
  return Verdict::kDone;
}

void Controller::apply(const ParameterSet& set) {
  const Gait gait = gait_of(set);
  const SupplyCode code = SupplyCode::of(set.pressure_mpsi);
  const Critical guard;
  wanted_code_ = code;
  oscillators_.use(gait);
  wanted_mpsi_ = set.pressure_mpsi;
  host_timeout_ms_ = set.host_timeout_ms;
}

Verdict Controller::schedule_add(uint32_t time_ms, Chamber chamber, ChamberState state) {
  const Critical guard;
  if (schedule_.running()) return Verdict::kRefused;
  if (!schedule_.in_order(time_ms)) return Verdict::kOrder;
  return schedule_.add(time_ms, chamber, state) ? Verdict::kDone : Verdict::kFull;
}

Verdict Controller::schedule_clear() {
  const Critical guard;
  if (schedule_.running()) supervisor_.idle();
  schedule_.clear();
  return Verdict::kDone;
}

Verdict Controller::schedule_start() {
  const Critical guard;
  if (supervisor_.is_latched()) return Verdict::kLatched;
  if (supervisor_.state() == State::kRunning || schedule_.running()) return Verdict::kRefused;
  host_silence_ms_ = 0;
  schedule_.start();
  return Verdict::kDone;
}

Verdict Controller::measure_zero(Calibration& measured) const {
  const Critical guard;
  if (supervisor_.state() != State::kIdle) return Verdict::kRefused;
  if (!rest_.is_long()) return Verdict::kUnrest;
  for (uint8_t i = 0; i < kChamberCount; ++i) measured.offset_mpsi[i] = rest_.mean_mpsi(i);
  return is_valid(measured) ? Verdict::kDone : Verdict::kOffset;
}

void Controller::calibrate(const Calibration& calibration) {
  const Critical guard;
  calibration_ = calibration;
}

void Controller::mark_strobe() {
  const Critical guard;
  // In the last millisecond of a period the next strobe can no longer be cancelled.
  strobes_left_out_ = kMarkPause + (since_sample_ms_ == kSamplePeriod_ms - 1 ? 1 : 0);
  marked_ = sampling_.sequence + 1 + strobes_left_out_;
}

uint16_t Controller::marked() const {
  const Critical guard;
  return marked_;
}

bool Controller::take_sample(Sample& sample) {
  const Critical guard;
  if (!sample_waits_) return false;
  sample = sample_;
  sample_waits_ = false;
  return true;
}

void Controller::lose_sample() {
  const Critical guard;
  if (samples_lost_ < UINT16_MAX) ++samples_lost_;
}

Status Controller::status() const {
  const Critical guard;
  Status status;
  status.state = supervisor_.state();
  status.emergency_stop = emergency_stop_;
  status.scheduled = schedule_.running();
  status.fault = supervisor_.fault();
  for (uint8_t i = 0; i < kChamberCount; ++i) status.pressure_mpsi[i] = sample_.pressure_mpsi[i];
  status.valves = supervisor_.valves().bits();
  status.uptime_ms = uptime_ms_;
  status.samples_lost = samples_lost_;
  return status;
}

uint32_t Controller::uptime_ms() const {
  const Critical guard;
  return uptime_ms_;
}

void Controller::host_heard() {
  const Critical guard;
  host_silence_ms_ = 0;
}

void Controller::in_session(bool yes) {
  const Critical guard;
  in_session_ = yes;
}

SupplyCode Controller::supply() const {
  const Critical guard;
  return supervisor_.state() == State::kFault ? SupplyCode() : wanted_code_;
}

void Controller::supply_told(bool answered) {
  const Critical guard;
  dac_.told(answered);
  if (dac_.failed()) trip(Fault::kSupplyControl, kNoChannel, kDacAttempts, kDacAttempts - 1);
}

// ---- interrupts ----

bool Controller::tick(bool emergency_stop_pressed) {
  {
    const Critical guard;
    ++uptime_ms_;
    emergency_stop_ = emergency_stop_pressed;
    if (emergency_stop_pressed) stop_in_interrupt();
  }
  if (++since_sample_ms_ == kSamplePeriod_ms) {
    since_sample_ms_ = 0;
    begin_sample();
  }
  watch_host();  // before anything that could open a valve
  step_oscillators();
  follow_schedule();
  {
    const Critical guard;
    supervisor_.tick();
  }
  if (round_complete_) finish_sample();
  return since_sample_ms_ == kSamplePeriod_ms - 1;
}

void Controller::converted_in_interrupt(const RawRound& round) {
  round_ = round;
  round_complete_ = true;
}

void Controller::step_oscillators() {
  if (supervisor_.state() != State::kRunning) return;
  oscillators_.step();
  const Critical guard;  // after a stop in between, walk() does nothing
  supervisor_.walk(oscillators_.outputs());
}

void Controller::follow_schedule() {
  if (!schedule_.running()) return;
  const Critical guard;
  if (supervisor_.is_latched()) schedule_.stop();
  Chamber chamber;
  ChamberState state;
  while (schedule_.take(chamber, state)) supervisor_.hold(chamber, state);
  schedule_.tick();
}

void Controller::begin_sample() {
  const Critical guard;
  ++sampling_.sequence;
  if (strobes_left_out_ > 0) --strobes_left_out_;
  sampling_.time_us = uptime_ms_ * 1000;
  sampling_.state = supervisor_.state();
  sampling_.valves = supervisor_.valves().bits();
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    sampling_.phase[i] = static_cast<uint16_t>(oscillators_.phase(i) >> kPhaseShift);
    sampling_.command[i] = supervisor_.wanted(i);
  }
}

void Controller::finish_sample() {
  round_complete_ = false;
  int16_t raw_mpsi[kChamberCount];
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    raw_mpsi[i] = sensor_mpsi(round_.sum[i]);
    sampling_.pressure_mpsi[i] = pressure_mpsi(i);
  }
  rest_.add(raw_mpsi);
  if (supervisor_.state() != State::kIdle) rest_.restart();  // held air may be steady, too
  last_second_.add(sampling_.pressure_mpsi);
  watch(sampling_.pressure_mpsi);
  if (sample_waits_) lose_sample();
  sample_ = sampling_;
  sample_waits_ = true;
}

/// The pressure in the last round.
int16_t Controller::pressure_mpsi(uint8_t chamber) const {
  return sensor_mpsi(round_.sum[chamber]) - calibration_.offset_mpsi[chamber];
}

void Controller::watch(const int16_t (&pressure_mpsi)[kChamberCount]) {
  trip_limit_.follow(set_point_mpsi());
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    const SensorWatch::Finding finding =
        sensors_[i].look(round_.sum[i], pressure_mpsi[i], trip_limit_.mpsi(), supervisor_.wanted(i));
    if (finding.fault != Fault::kNone) trip(finding.fault, i, pressure_mpsi[i], finding.limit);
  }
  if (regulator_.look(round_.monitor, set_point_mpsi())) {
    trip(Fault::kRegulator, kNoChannel, monitor_mpsi(round_.monitor), static_cast<int16_t>(set_point_mpsi()));
  }
}

void Controller::watch_host() {
  const uint16_t timeout_ms = host_timeout_ms_ == 0 && in_session_ ? kSessionTimeout_ms : host_timeout_ms_;
  if (timeout_ms == 0) return;
  ++host_silence_ms_;  // reset whenever air starts to move, so an overflow is harmless
  if (host_silence_ms_ < timeout_ms || !(supervisor_.moves_air() || schedule_.running())) return;
  trip(Fault::kHostSilent, kNoChannel, static_cast<int16_t>(host_silence_ms_ / kSilenceUnit_ms),
       static_cast<int16_t>(timeout_ms / kSilenceUnit_ms));
}

void Controller::trip(Fault fault, uint8_t channel, int16_t value, int16_t limit) {
  const Critical guard;
  supervisor_.trip(fault, channel, value, limit, uptime_ms_, last_second_);
}

bool Controller::cause_stands() const {
  const FaultReport& fault = supervisor_.fault();
  switch (fault.fault) {
    case Fault::kOverPressure:
    case Fault::kSensorRange:
      for (uint8_t i = 0; i < kChamberCount; ++i) {
        if (SensorWatch::stands(fault.fault, round_.sum[i], pressure_mpsi(i), fault.limit)) return true;
      }
      return false;
    case Fault::kRegulator:
      return regulator_.deviates();
    case Fault::kSupplyControl:
      return dac_.failed();
    default:
      return false;
  }
}

uint16_t Controller::set_point_mpsi() const { return supervisor_.state() == State::kFault ? 0 : wanted_mpsi_; }

}  // namespace bifa
