#include "store.h"

namespace bifa {

namespace {
const uint8_t kCopies = 2;

uint32_t bit(uint8_t slot) { return static_cast<uint32_t>(1) << slot; }
bool same_name(const char* a, const char* b) { return strncmp(a, b, kNameSize) == 0; }
}  // namespace

void Store::begin() {
  live_ = 0;
  sequence_ = 0;
  uint32_t good = 0;
  Record record;
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    if (!read_record(eeprom_, slot, record)) continue;
    good |= bit(slot);
    if (record.sequence < sequence_) continue;
    sequence_ = record.sequence;
    cursor_ = slot + 1;
  }
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    if (!(good & bit(slot))) continue;
    read_record(eeprom_, slot, record);
    bool is_newest = true;
    for (uint8_t i = 0; i < kSlotCount && is_newest; ++i) {
      is_newest = !(good & bit(i)) || !is_named(i, record.name) || sequence_of(eeprom_, i) <= record.sequence;
    }
    if (is_newest) live_ |= bit(slot);
  }
  look_for_single_copies();
}

bool Store::newest(const char* name, Record& record) {
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    if (is_live(slot) && read_record(eeprom_, slot, record) && same_name(record.name, name)) return true;
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
  Record record;
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    if (!is_live(slot) || !read_record(eeprom_, slot, record) || same_name(record.name, kSettingsName)) continue;
    bool is_second_copy = false;
    for (uint8_t i = 0; i < slot; ++i) is_second_copy = is_second_copy || (is_live(i) && is_named(i, record.name));
    if (is_second_copy || index-- > 0) continue;
    memcpy(name, record.name, kNameSize);
    name[kNameSize] = '\0';
    return true;
  }
  return false;
}

uint8_t Store::count() {
  char name[kNameSize + 1];
  uint8_t count = 0;
  while (name_at(count, name)) ++count;
  return count;
}

bool Store::is_named(uint8_t slot, const char* name) {
  const uint16_t address = slot_address(slot);
  if (eeprom_.read(address) != kRecordValid) return false;
  for (uint8_t i = 0; i < kNameSize; ++i) {
    if (eeprom_.read(address + offsetof(Record, name) + i) != static_cast<uint8_t>(name[i])) return false;
  }
  return true;
}

Result Store::save(const char* name, const ParameterSet& set) {
  ParameterSet factory;
  char text[kNameSize + 1];
  memcpy(text, name, kNameSize);
  text[kNameSize] = '\0';
  if (!is_name(name) || find_factory_preset(text, factory)) return Result::kName;
  Record record;
  if (!busy() && !newest(name, record) && count() >= kPresetLimit) return Result::kFull;
  return save_record(name, reinterpret_cast<const uint8_t*>(&set));
}

Result Store::save_settings(const uint8_t* payload) { return save_record(kSettingsName, payload); }

Result Store::save_record(const char* name, const uint8_t* payload) {
  if (busy()) return Result::kBusy;
  memcpy(record_.name, name, kNameSize);
  memcpy(record_.payload, payload, sizeof record_.payload);
  record_.sequence = sequence_ + 1;
  seal(record_);
  written_ = 0;
  failed_ = 0;
  doomed_ = 0;
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    if (is_named(slot, name)) doomed_ |= bit(slot);
  }
  copies_ = kCopies;
  job_ = Job::kSave;
  next_copy();
  return job_ == Job::kNone ? result_ : Result::kOk;
}

Result Store::forget(const char* name) {
  if (busy()) return Result::kBusy;
  doomed_ = 0;
  bool found = false;
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    if (!is_named(slot, name)) continue;
    doomed_ |= bit(slot);
    found = found || is_live(slot);
  }
  if (!found || !is_name(name)) return Result::kNoPreset;
  failed_ = 0;
  job_ = Job::kVoid;
  return Result::kOk;
}

Result Store::erase_all() {
  if (busy()) return Result::kBusy;
  doomed_ = bit(kSlotCount) - 1;
  failed_ = 0;
  job_ = Job::kVoid;
  return Result::kOk;
}

void Store::look_for_single_copies() {
  for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
    if (!is_live(slot) || !read_record(eeprom_, slot, record_)) continue;
    uint8_t copies = 0;
    for (uint8_t i = 0; i < kSlotCount; ++i) copies += is_live(i) && is_named(i, record_.name);
    if (copies >= kCopies) continue;
    doomed_ = written_ = failed_ = 0;
    copies_ = kCopies - copies;
    job_ = Job::kRepair;
    next_copy();
    return;
  }
}

bool Store::take_free_slot() {
  for (uint8_t tries = 0; tries < kSlotCount; ++tries) {
    if (cursor_ >= kSlotCount) cursor_ = 0;
    slot_ = cursor_++;
    if (((live_ | written_ | failed_) & bit(slot_)) || is_from_the_future(eeprom_, slot_)) continue;
    doomed_ &= ~bit(slot_);
    return true;
  }
  return false;
}

void Store::next_copy() {
  at_ = 0;
  if (!take_free_slot()) finish(failed_ ? Result::kEeprom : Result::kFull);
}

void Store::poll() {
  if (job_ == Job::kNone || eeprom_.busy()) return;
  if (job_ == Job::kVoid || copies_ == 0) {
    step_void();
  } else {
    step_write();
  }
}

/// Writes one byte unless it is there already; false when there was nothing to do.
bool Store::put(uint16_t address, uint8_t value) {
  if (eeprom_.read(address) == value) return false;
  eeprom_.write(address, value);
  return true;
}

/// First the mark is voided, then come the other bytes, then all are compared, and the mark is written last.
void Store::step_write() {
  const uint16_t address = slot_address(slot_);
  const uint8_t* bytes = reinterpret_cast<const uint8_t*>(&record_);
  while (at_ < sizeof record_) {
    const uint8_t i = at_++;
    if (put(address + i, i == 0 ? kRecordVoid : bytes[i])) return;
  }
  bool kept = true;
  for (uint8_t i = 1; i < sizeof record_; ++i) kept = kept && eeprom_.read(address + i) == bytes[i];
  if (at_ == sizeof record_ && kept) {
    ++at_;
    eeprom_.write(address, kRecordValid);
    return;
  }
  if (!kept || eeprom_.read(address) != kRecordValid) {
    failed_ |= bit(slot_);
    next_copy();
    return;
  }
  written_ |= bit(slot_);
  if (--copies_ > 0) next_copy();
}

/// Voids the doomed slots, those with older copies first, so that none of these comes back to life.
void Store::step_void() {
  for (uint8_t pass = 0; pass < 2; ++pass) {
    for (uint8_t slot = 0; slot < kSlotCount; ++slot) {
      if (!(doomed_ & bit(slot)) || is_live(slot) != (pass == 1)) continue;
      if (eeprom_.read(slot_address(slot)) != kRecordValid) {
        doomed_ &= ~bit(slot);
        continue;
      }
      if (failed_ & bit(slot)) return finish(Result::kEeprom);
      failed_ |= bit(slot);  // unless it reads back as void the next time
      eeprom_.write(slot_address(slot), kRecordVoid);
      return;
    }
  }
  finish(Result::kOk);
}

void Store::finish(Result result) {
  const bool was_repair = job_ == Job::kRepair;
  job_ = Job::kNone;
  begin();
  if (!was_repair) result_ = result;
  if (result == Result::kOk) return;
  job_ = Job::kNone;  // a cell that cannot be written is not tried again until the next save
}

}  // namespace bifa
