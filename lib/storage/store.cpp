#include "store.h"

namespace bifa {

namespace {
const uint8_t kCopies = 2;

bool same_name(const char* a, const char* b) { return strncmp(a, b, kNameSize) == 0; }
}  // namespace

void Store::begin() {
  scan();
  repair();
}

void Store::scan() {
  sequence_ = 0;
  Record record;
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    marks_[slot] = is_from_the_future(slot) ? kTaken : 0;
    if (!read_record(slot, record)) continue;
    marks_[slot] = kGood;
    if (record.sequence < sequence_) continue;
    sequence_ = record.sequence;
    cursor_ = slot + 1;
  }
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    if (!has(slot, kGood)) continue;
    read_record(slot, record);
    bool is_newest = true;
    for (uint8_t i = 0; i < kSlotCount && is_newest; ++i) {
      is_newest = !has(i, kGood) || !is_named(i, record.name) || sequence_of(i) <= record.sequence;
    }
    if (is_newest) marks_[slot] |= kLive;
  }
}

bool Store::newest(const char* name, Record& record) {
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    if (has(slot, kLive) && read_record(slot, record) && same_name(record.name, name)) return true;
  }
  return false;
}

bool Store::load(const char* name, ParameterSet& set) {
  Record record;
  if (!newest(name, record)) return false;
  ParameterSet candidate;
  memcpy(&candidate, record.payload, sizeof candidate);
  if (!is_valid(candidate)) return false;
  set = candidate;
  return true;
}

bool Store::load_settings(uint8_t* payload) {
  Record record;
  if (!newest(kSettingsName, record)) return false;
  memcpy(payload, record.payload, sizeof record.payload);
  return true;
}

bool Store::name_at(uint8_t index, char* name) {
  name[kNameSize] = '\0';
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    if (!has(slot, kLive) || is_named(slot, kSettingsName)) continue;
    for (uint8_t i = 0; i < kNameSize; ++i) name[i] = eeprom_read(slot_address(slot) + offsetof(Record, name) + i);
    bool is_second_copy = false;
    for (uint8_t i = 0; i < slot; ++i) is_second_copy = is_second_copy || (has(i, kLive) && is_named(i, name));
    if (!is_second_copy && index-- == 0) return true;
  }
  return false;
}

uint8_t Store::count() {
  char name[kNameSize + 1];
  uint8_t count = 0;
  while (name_at(count, name)) ++count;
  return count;
}

/// Whether a slot that is not void has this name.
bool Store::is_named(uint8_t slot, const char* name) {
  const uint16_t address = slot_address(slot);
  if (!is_written(slot)) return false;
  for (uint8_t i = 0; i < kNameSize; ++i) {
    if (eeprom_read(address + offsetof(Record, name) + i) != static_cast<uint8_t>(name[i])) return false;
  }
  return true;
}

Result Store::save(const char* name, const ParameterSet& set) {
  if (busy()) return Result::kBusy;
  ParameterSet factory;
  Record record;
  if (!is_name(name) || find_factory_preset(name, factory)) return Result::kName;
  if (!newest(name, record) && count() >= kPresetLimit) return Result::kFull;
  return save_record(name, &set);
}

Result Store::save_settings(const void* payload) {
  return busy() ? Result::kBusy : save_record(kSettingsName, payload);
}

Result Store::save_record(const char* name, const void* payload) {
  scan();                                                   // a repair may have been in progress
  if (sequence_ >= kSequenceLimit) return Result::kEeprom;  // a record with the next number could not be read back
  memcpy(record_.name, name, kNameSize);
  memcpy(record_.payload, payload, sizeof record_.payload);
  record_.sequence = sequence_ + 1;
  seal(record_);
  doom(name);
  copies_ = kCopies;
  job_ = Job::kSave;
  next_copy();
  return busy() ? Result::kOk : result_;
}

Result Store::forget(const char* name) {
  if (busy()) return Result::kBusy;
  bool known = false;  // also if written by a later firmware, whose records are kTaken
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    known = known || (has(slot, kLive | kTaken) && is_named(slot, name));
  }
  if (!is_name(name) || !known) return Result::kNoPreset;
  scan();
  doom(name);
  job_ = Job::kVoid;
  return Result::kOk;
}

Result Store::erase_all() {
  if (busy()) return Result::kBusy;
  scan();
  doom(nullptr);
  job_ = Job::kVoid;
  return Result::kOk;
}

/// Marks every slot of that name for voiding, or all slots if `name` is null.
void Store::doom(const char* name) {
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    if (name == nullptr || is_named(slot, name)) marks_[slot] |= kDoomed;
  }
}

void Store::repair() {
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    if (!has(slot, kLive) || !read_record(slot, record_)) continue;
    uint8_t copies = 0;
    for (uint8_t i = 0; i < kSlotCount; ++i) copies += has(i, kLive) && is_named(i, record_.name);
    if (copies >= kCopies) continue;
    copies_ = kCopies - copies;
    job_ = Job::kRepair;
    return next_copy();
  }
}

/// Starts a copy of the record in the next free slot.
void Store::next_copy() {
  at_ = 0;
  for (uint8_t tries = 0; tries < kSlotCount; ++tries) {
    if (cursor_ >= kSlotCount) cursor_ = 0;
    slot_ = cursor_++;
    if (has(slot_, kLive | kTaken | kFailed)) continue;
    marks_[slot_] &= ~kDoomed;
    return;
  }
  if (job_ == Job::kSave && copies_ < kCopies) {
    copies_ = 0;  // repair() writes the second copy once the old ones have made room
  } else {
    end(Result::kEeprom);
  }
}

void Store::poll() {
  if (job_ == Job::kNone || eeprom_busy()) return;
  if (job_ == Job::kVoid || copies_ == 0) {
    step_void();
  } else {
    step_write();
  }
}

/// Voids the mark, writes the other bytes, and writes the mark last. Each step first compares all that the earlier ones
/// wrote, so that a slot with a bad cell is given up at once.
void Store::step_write() {
  const uint16_t address = slot_address(slot_);
  const uint8_t* bytes = reinterpret_cast<const uint8_t*>(&record_);
  const uint8_t mark = at_ > sizeof record_ ? kRecordValid : kRecordVoid;
  bool kept = true;
  for (uint8_t i = 0; i < at_ && i < sizeof record_; ++i) {
    kept = kept && eeprom_read(address + i) == (i == 0 ? mark : bytes[i]);
  }
  if (!kept) {
    marks_[slot_] |= kFailed;
    return next_copy();
  }
  while (at_ < sizeof record_) {
    const uint8_t value = at_ == 0 ? mark : bytes[at_];
    const uint16_t place = address + at_++;
    if (eeprom_read(place) == value) continue;  // skip unchanged bytes to save wear
    eeprom_write(place, value);
    return;
  }
  if (at_++ == sizeof record_) return eeprom_write(address, kRecordValid);
  marks_[slot_] |= kTaken;
  if (--copies_ > 0) next_copy();
}

/// Voids the doomed slots, those with older copies first, so that an older copy never becomes the newest one.
void Store::step_void() {
  for (uint8_t pass = 0; pass < 2; ++pass) {
    for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
      if (!has(slot, kDoomed) || has(slot, kLive) != (pass == 1)) continue;
      if (!is_written(slot)) {
        marks_[slot] &= ~kDoomed;
        continue;
      }
      if (has(slot, kFailed)) {
        if (job_ == Job::kSave) continue;  // the new copies count, since they are newer
        return end(Result::kEeprom);
      }
      // If it does not read back as void the next time, another byte is tried.
      const bool stuck = has(slot, kStuck);
      marks_[slot] |= stuck ? kFailed : kStuck;
      eeprom_write(slot_address(slot) + (stuck ? offsetof(Record, format) : offsetof(Record, mark)), kRecordVoid);
      return;
    }
  }
  end(Result::kOk);
  repair();  // continue with the next record; a cell that cannot be written is not retried for ever
}

void Store::end(Result result) {
  if (busy()) result_ = result;
  job_ = Job::kNone;
  scan();
}

}  // namespace bifa
