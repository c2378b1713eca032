// Implementation of the commands, shared by the console and frames.
#pragma once

#include "command_table.h"
#include "controller.h"
#include "store.h"

namespace bifa {

/// Name of the preset that is written by `save` without a name and loaded at start.
extern const char kStartPreset[kNameSize + 1];

class Commands {
 public:
  explicit Commands(Controller& controller) : controller_(controller) {}

  /// Starts the controller with the settings and the start preset from EEPROM, or else the baseline; call once.
  void begin(StartCause cause);

  Result run();
  Result stop();
  Result clear();
  Result hold(uint8_t chamber, uint8_t state);
  // A schedule is entered as a whole: clear, entries, start. After an error, start fails until the schedule is cleared.
  Result schedule_clear();
  Result schedule_add(uint32_t time_ms, uint8_t chamber, uint8_t state);
  Result schedule_start();

  /// Discards what an earlier session left unfinished: an uncommitted set, the loading of defaults and timed holds.
  void abandon();

  /// Changes one parameter (value in wire units) at once, also in a set waiting for the cycle boundary.
  Result set(ParameterId id, uint32_t value);

  // A new set is entered as a whole: begin, fields, commit. The first error makes commit fail, and the old set stays in
  // use. While walking, the new set takes effect at the next cycle boundary.
  Result begin_set();
  Result field(uint8_t parameter, uint32_t value);
  Result commit(uint16_t check);

  /// The running set, or the one that will take effect at the next cycle boundary.
  const ParameterSet& wanted() const { return wanted_; }
  bool is_pending() const { return pending_; }
  /// The set that power-up loads: the start preset, or else the baseline.
  ParameterSet at_power_up();
  /// Call with each new sample, which shows where in the cycle the robot is.
  void follow(const Sample& sample);

  /// Continues writing the EEPROM. Zero offsets take effect once they are stored, and defaults once everything has been
  /// erased, so a failed write changes neither.
  void poll();

  // EEPROM commands: Result::kOk while store().busy() means that the result follows later.
  Result save(const char* name);
  Result load(const char* name);
  Result forget(const char* name);
  Result defaults();
  Result zero(bool factory);

  /// Name of preset number `index`, factory presets first; `name` has kNameSize + 1 bytes.
  bool preset_at(uint8_t index, char* name, bool& stored);
  uint8_t preset_count();

  Controller& controller() { return controller_; }
  Store& store() { return store_; }

 private:
  enum class Draft : uint8_t { kNone, kOpen, kSpoilt };

  Calibration calibration_at_power_up();
  void use(const ParameterSet& set);
  Result take_over_soon(const ParameterSet& set);

  Controller& controller_;
  Store store_;
  ParameterSet running_;
  ParameterSet wanted_;
  ParameterSet draft_;
  Draft draft_state_ = Draft::kNone;
  bool pending_ = false;
  bool erasing_ = false;  ///< for `defaults`: the baseline is loaded if that succeeds
  bool schedule_spoilt_ = false;
  uint16_t last_phase_ = 0;
};

}  // namespace bifa
