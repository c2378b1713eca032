// Named parameter sets and the settings in EEPROM: two copies of each, so that neither a power cut nor a bad cell
// loses one.
//
// A save writes two new copies into free slots, each read back, its mark last; only then the old copies are voided.
// So at every moment the old or the new one is there whole. Free slots are taken in turn, which spreads the wear.
// Everything is written one byte at a time from poll(), without waiting.
#pragma once

#include "command_table.h"
#include "record.h"

namespace bifa {

const uint8_t kPresetLimit = 8;  ///< besides the settings: (8 + 1) x 2 copies leave three slots free of the 21

class Store {
 public:
  explicit Store(Eeprom& eeprom) : eeprom_(eeprom) {}

  /// Looks through the EEPROM; call once at start.
  void begin();

  /// The newest good copy of a parameter set. False: none, or its values are out of range.
  bool load(const char* name, ParameterSet& set);
  /// The settings (any bytes, as many as a parameter set has). False: none.
  bool load_settings(uint8_t* payload);

  /// How many different names are kept, the settings not counted.
  uint8_t count();
  /// The name of one of them; `name` has kNameSize + 1 bytes.
  bool name_at(uint8_t index, char* name);

  /// Start a job; Result::kOk means "started": poll() until busy() is over, then see result().
  Result save(const char* name, const ParameterSet& set);
  Result save_settings(const uint8_t* payload);
  Result forget(const char* name);
  Result erase_all();

  /// Goes on with the job by at most one byte.
  void poll();
  bool busy() const { return job_ != Job::kNone && job_ != Job::kRepair; }
  /// How the last job ended.
  Result result() const { return result_; }

 private:
  enum class Job : uint8_t { kNone, kSave, kRepair, kVoid };

  bool is_live(uint8_t slot) const { return (live_ >> slot) & 1; }
  bool newest(const char* name, Record& record);
  bool is_named(uint8_t slot, const char* name);
  Result save_record(const char* name, const uint8_t* payload);
  void look_for_single_copies();
  bool take_free_slot();
  void next_copy();
  void step_write();
  void step_void();
  void finish(Result result);
  bool put(uint16_t address, uint8_t value);

  Eeprom& eeprom_;
  uint32_t live_ = 0;      ///< bit per slot: holds a newest copy
  uint32_t sequence_ = 0;  ///< of the newest record of all
  uint8_t cursor_ = 0;     ///< where to look for the next free slot
  Job job_ = Job::kNone;
  Result result_ = Result::kOk;
  Record record_;         ///< being written
  uint32_t written_ = 0;  ///< slots that the job has completed
  uint32_t doomed_ = 0;   ///< slots to be voided at the end
  uint32_t failed_ = 0;   ///< slots that did not keep what was written during this job
  uint8_t slot_ = 0;
  uint8_t at_ = 0;      ///< byte of the record to be written next
  uint8_t copies_ = 0;  ///< still to be written
};

}  // namespace bifa
