// Named parameter sets and the settings in EEPROM: two copies of each, so that neither a power cut nor a bad cell
// loses one.
//
// A save writes two new copies into free slots, each read back and its mark written last; only then are the old copies
// voided. So at every moment the old or the new version is complete. Free slots are used in rotation, for wear
// levelling. Everything is written one byte at a time from poll(), without blocking.
#pragma once

#include "command_table.h"
#include "record.h"

namespace bifa {

const uint8_t kPresetLimit = 8;  ///< besides the settings: (8 + 1) x 2 copies leave three slots free of the 21

class Store {
 public:
  /// Scans the EEPROM; call once at start. If only one copy of a record is good, the second is rewritten.
  void begin();

  /// Loads the newest good copy of a parameter set. Returns false if there is none, or if its values are out of range.
  bool load(const char* name, ParameterSet& set);
  /// Loads the settings (arbitrary bytes, as many as a parameter set has). Returns false if there are none.
  bool load_settings(uint8_t* payload);

  /// How many different names are stored, not counting the settings.
  uint8_t count();
  /// The name number `index` of these; `name` has kNameSize + 1 bytes.
  bool name_at(uint8_t index, char* name);

  /// These start a job; Result::kOk means "started": call poll() until busy() is false, then see result().
  Result save(const char* name, const ParameterSet& set);
  Result save_settings(const void* payload);
  Result forget(const char* name);
  Result erase_all();

  /// Continues the job by at most one byte.
  void poll();
  bool busy() const { return job_ == Job::kSave || job_ == Job::kVoid; }
  /// Result of the last job.
  Result result() const { return result_; }

 private:
  enum class Job : uint8_t { kNone, kSave, kRepair, kVoid };
  /// Properties of a slot; several may apply.
  enum Mark : uint8_t {
    kGood = 1,    ///< holds a good record
    kLive = 2,    ///< its record is the newest of its name
    kTaken = 4,   ///< not free: written by the job, or belongs to a later firmware
    kDoomed = 8,  ///< will be voided by the job
    kStuck = 16,  ///< its mark could not be voided
    kFailed = 32  ///< did not retain what the job wrote
  };

  bool has(uint8_t slot, uint8_t mark) const { return marks_[slot] & mark; }
  bool is_named(uint8_t slot, const char* name);
  bool newest(const char* name, Record& record);
  void scan();
  void repair();
  Result save_record(const char* name, const void* payload);
  void doom(const char* name);
  void next_copy();
  void step_write();
  void step_void();
  void end(Result result);

  uint32_t sequence_ = 0;  ///< of the newest of all records
  uint8_t cursor_ = 0;     ///< where to look for the next free slot
  Job job_ = Job::kNone;
  Result result_ = Result::kOk;
  uint8_t slot_ = 0;
  uint8_t at_ = 0;      ///< byte of the record to be written next
  uint8_t copies_ = 0;  ///< copies still to be written
  uint8_t marks_[kSlotCount];
  Record record_;  ///< being written
};

}  // namespace bifa
