// The controller's facade: the complete interface for the console, the frames and the board.
//
// tick() and the *_in_interrupt functions run in interrupts, everything else in the main loop. Shared data are guarded
// inside, so callers need no guard of their own.
#pragma once

#include "calibration.h"
#include "oscillators.h"
#include "parameter_table.h"
#include "rest.h"
#include "sample.h"
#include "schedule.h"
#include "sensor.h"
#include "sensor_watch.h"
#include "supervisor.h"
#include "supply.h"
#include "supply_watch.h"

namespace bifa {

/// Outcome of a request.
enum class Verdict : uint8_t {
  kDone,
  kLatched,      ///< stopped, or a fault is latched: clear first
  kRefused,      ///< not in this state
  kCauseStands,  ///< clear: the emergency stop is still pressed, or the cause of the fault is still present
  kFull,         ///< the schedule is full
  kOrder,        ///< the schedule's times must not decrease
  kUnrest,       ///< the pressures have not been steady for long enough
  kOffset,       ///< a pressure is too far from zero to be an offset
};

/// The controller's status, for the console and the host.
struct Status {
  State state;
  bool emergency_stop;  ///< the input is active now
  bool scheduled;       ///< timed holds are running
  FaultReport fault;    ///< fault.fault is kNone if there is none
  int16_t pressure_mpsi[kChamberCount];
  uint8_t valves;  ///< bits of ValvePattern
  uint32_t uptime_ms;
  uint16_t samples_lost;  ///< not taken by the main loop in time, or requested but not sent, as text or frames
};

/// Why the chip started. kRestart: by itself, after a hang with interrupts off or a dip of its supply.
enum class StartCause : uint8_t { kPower, kExternal, kBrownOut, kWatchdog, kRestart };

class Controller {
 public:
  // ---- main loop ----

  /// Call once, before the first tick. If the chip restarted by itself, the controller begins in a fault.
  void begin(StartCause cause, const ParameterSet& set, const Calibration& calibration);

  Verdict run();   ///< from idle, unless timed holds run; the oscillators start settled, with the body at phase 0
  Verdict stop();  ///< to idle; all chambers vent (a latched stop or fault remains)
  /// From idle or holding. Once all chambers are off again, the controller is idle.
  Verdict hold(Chamber chamber, ChamberState state);
  /// Refused for a command that was sent before the last stop or fault (see hear_from_now_on()).
  Verdict clear();

  /// Takes effect at the next tick, also while running, without a phase jump. The set must be valid (is_valid()).
  void apply(const ParameterSet& set);

  /// Timed holds, executed on the tick; time 0 is the first tick after the start. stop(), a stop or a fault ends them.
  Verdict schedule_add(uint32_t time_ms, Chamber chamber, ChamberState state);
  Verdict schedule_clear();  ///< if they are running, all chambers vent, since nothing else would end their holds
  Verdict schedule_start();  ///< from idle or holding, once

  /// Takes the present pressures as zero: only while idle, if they have been steady for 4 s (Rest), and if each is
  /// within kGreatestOffset_mpsi.
  Verdict measure_zero(Calibration& measured) const;
  void calibrate(const Calibration& calibration);  ///< must be valid (is_valid())
  const Calibration& calibration() const { return calibration_; }

  /// Omits the next kMarkPause strobes, but not the samples: an instrument that stamps the strobe sees the pause.
  void mark_strobe();
  /// The number of the sample with the first strobe after the last such pause; 0 if there has been none.
  uint16_t marked() const;

  /// Takes the next sample; returns false if there is no new one.
  bool take_sample(Sample& sample);
  /// Counts a requested sample that could not be sent.
  void lose_sample();
  Status status() const;
  State state() const { return supervisor_.state(); }
  uint32_t uptime_ms() const;

  /// All commands from now on count as sent after the last stop or fault, until the next one; call with interrupts off.
  void hear_from_now_on() { supervisor_.hear_from_now_on(); }

  /// Call whenever the host has sent a valid frame or command.
  void host_heard();

  /// Whether a host has a session. Since a host may be killed, kSessionTimeout_ms then replaces a `host_timeout_s` of
  /// 0.
  void in_session(bool yes);

  /// The value to write to the DAC now; the caller reports the outcome with supply_told().
  SupplyCode supply() const;
  void supply_told(bool answered);

  // ---- interrupts ----

  /// Call every millisecond. Returns true (every tenth tick) if a round of conversions is to begin with the next tick;
  /// the strobe then rises if strobes(). Other interrupts may nest in it: shared data are guarded inside.
  bool tick(bool emergency_stop_pressed);

  /// After a tick that returned true: whether the strobe is to rise; false if it is omitted for a mark.
  bool strobes() const { return strobes_left_out_ == 0; }

  /// Call when a round of conversions is complete.
  void converted_in_interrupt(const RawRound& round);

  /// For the byte `!`, the stop message and the emergency stop: all valves are off on return.
  void stop_in_interrupt() { supervisor_.stop(); }

 private:
  void step_oscillators();
  void follow_schedule();
  void begin_sample();
  void finish_sample();
  void watch(const int16_t (&pressure_mpsi)[kChamberCount]);
  void watch_host();
  int16_t pressure_mpsi(uint8_t chamber) const;
  void trip(Fault fault, uint8_t channel, int16_t value, int16_t limit);
  bool cause_stands() const;
  uint16_t set_point_mpsi() const;

  // Small members come first: an AVR's shortest instructions reach 64 bytes from the beginning of an object.
  uint32_t uptime_ms_ = 0;
  uint8_t since_sample_ms_ = 0;
  uint8_t strobes_left_out_ = 0;  ///< strobes still to be omitted
  uint16_t marked_ = 0;
  volatile bool emergency_stop_ = false;  ///< the stop is latched again for as long as it is pressed

  uint16_t wanted_mpsi_ = 0;
  SupplyCode wanted_code_;
  uint16_t host_timeout_ms_ = 0;
  uint16_t host_silence_ms_ = 0;
  bool in_session_ = false;

  RawRound round_ = {};
  volatile bool round_complete_ = false;
  Sample sampling_ = {};  ///< the sample being converted
  Sample sample_ = {};
  bool sample_waits_ = false;
  uint16_t samples_lost_ = 0;
  Rest rest_;

  TripLimit trip_limit_;
  DacWatch dac_;
  RegulatorWatch regulator_;
  Calibration calibration_ = {};
  SensorWatch sensors_[kChamberCount];
  Supervisor supervisor_;
  Oscillators oscillators_;
  Schedule schedule_;
  LastSecond last_second_;
};

}  // namespace bifa
