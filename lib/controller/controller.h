// The controller behind one facade: what the console, the frames and the board call, and nothing else.
//
// tick() and the *_in_interrupt functions run in interrupts; everything else in the main loop. What both touch is
// guarded inside, so callers need no guard of their own.
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

/// What became of a request.
enum class Verdict : uint8_t {
  kDone,
  kLatched,      ///< stopped, or a fault stands: clear first
  kRefused,      ///< not in this state
  kCauseStands,  ///< clear: the emergency stop is still pressed, or the cause of the fault is still there
  kFull,         ///< the schedule is full
  kOrder,        ///< the schedule's times must not go backwards
  kUnrest,       ///< the pressures have not rested for long enough
  kOffset,       ///< a pressure is too far from zero to be an offset
};

/// What a person or the host wants to know at once.
struct Status {
  State state;
  bool emergency_stop;  ///< the input is active now
  bool scheduled;       ///< timed holds are running
  FaultReport fault;    ///< fault.fault is kNone without one
  int16_t pressure_mpsi[kChamberCount];
  uint8_t valves;  ///< bits of ValvePattern
  uint32_t uptime_ms;
  uint16_t
      samples_lost;  ///< that the main loop did not take in time, or that were asked for but not sent, in either form
};

/// Why the chip started. kRestart: by itself, because it hung with interrupts off or its supply dipped.
enum class StartCause : uint8_t { kPower, kExternal, kBrownOut, kWatchdog, kRestart };

class Controller {
 public:
  // ---- main loop ----

  /// Once, before the first tick. When the chip restarted by itself the controller begins in a fault.
  void begin(StartCause cause, const ParameterSet& set, const Calibration& calibration);

  Verdict run();   ///< from idle, unless timed holds run; the oscillators start settled, the body at phase 0
  Verdict stop();  ///< to idle; all chambers vent (a latched stop or fault stays)
  /// From idle or holding. When all chambers are off again the controller is idle.
  Verdict hold(Chamber chamber, ChamberState state);
  /// Not on behalf of a command that came before the last stop or fault (see hear_from_now_on()).
  Verdict clear();

  /// Takes effect at the next tick, also while running, without a jump of the phases. The set must be valid (is_valid()).
  void apply(const ParameterSet& set);

  /// Timed holds, executed on the tick; time 0 is the first tick after the start. stop(), a stop, a fault end them.
  Verdict schedule_add(uint32_t time_ms, Chamber chamber, ChamberState state);
  Verdict schedule_clear();  ///< if they run all chambers vent: nobody else would end what they began
  Verdict schedule_start();  ///< from idle or holding, once

  /// Takes the present pressures as zero: only while idle, if they have rested for 4 s (Rest), and if each is within
  /// kGreatestOffset_mpsi.
  Verdict measure_zero(Calibration& measured) const;
  void calibrate(const Calibration& calibration);  ///< it must be valid (is_valid())
  const Calibration& calibration() const { return calibration_; }

  /// Leaves out the next kMarkPause strobes, not the samples: an instrument that stamps the strobe sees the pause.
  void mark_strobe();
  /// The number of the sample whose strobe is the first after the last such pause; 0 before any.
  uint16_t marked() const;

  /// The next sample, if there is a new one.
  bool take_sample(Sample& sample);
  /// One that was asked for could not be sent.
  void lose_sample();
  Status status() const;
  State state() const { return supervisor_.state(); }
  uint32_t uptime_ms() const;

  /// All commands from now on come after the last stop or fault, until the next one; call it with interrupts off.
  void hear_from_now_on() { supervisor_.hear_from_now_on(); }

  /// Call it whenever the host has said something that makes sense.
  void host_heard();

  /// Whether a host has a session. It may be killed, so where `host_timeout_s` is 0 kSessionTimeout_ms stands for it.
  void in_session(bool yes);

  /// What the DAC has to be told now. Whoever tells it reports how that ended.
  SupplyCode supply() const;
  void supply_told(bool answered);

  // ---- interrupts ----

  /// Every millisecond. Returns true if a round of conversions is to begin with the next tick, and the strobe to rise
  /// then if it strobes() (every tenth tick). Other interrupts may nest in it: what they share is guarded inside.
  bool tick(bool emergency_stop_pressed);

  /// After a tick that returned true: whether the strobe really is to rise, or is left out for a mark.
  bool strobes() const { return strobes_left_out_ == 0; }

  /// A round of the converter is complete.
  void converted_in_interrupt(const RawRound& round);

  /// The byte `!`, the stop message or the emergency stop: all valves are off when it returns.
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

  // What is small comes first: an AVR reaches 64 bytes from an object's beginning with its shortest instructions.
  uint32_t uptime_ms_ = 0;
  uint8_t since_sample_ms_ = 0;
  uint8_t strobes_left_out_ = 0;  ///< still to be left out
  uint16_t marked_ = 0;
  volatile bool emergency_stop_ = false;  ///< latched, too, for as long as it is pressed

  uint16_t wanted_mpsi_ = 0;
  SupplyCode wanted_code_;
  uint16_t host_timeout_ms_ = 0;
  uint16_t host_silence_ms_ = 0;
  bool in_session_ = false;

  RawRound round_ = {};
  volatile bool round_complete_ = false;
  Sample sampling_ = {};  ///< its conversions are under way
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
