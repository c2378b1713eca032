#include "record.h"

#include "crc.h"

namespace bifa {

// Defined once: such constants are kept in RAM, and every file with its own copy would take 13 bytes more.
const char kSettingsName[kNameSize + 1] = "#settings";

namespace {
const uint8_t kHeadBytes = offsetof(Record, payload);

void read_bytes(uint16_t address, void* to, uint8_t size) {
  uint8_t* bytes = static_cast<uint8_t*>(to);
  for (uint8_t i = 0; i < size; ++i) bytes[i] = eeprom_read(address + i);
}

const uint8_t* bytes_of(const Record& record) { return reinterpret_cast<const uint8_t*>(&record); }

/// Fields are only ever added at the end, so that an older payload is a prefix of the present one.
void migrate(Record& record, uint8_t from_format) {
  const ParameterSet fallback = factory_preset(0);
  const uint8_t known = payload_size(from_format);
  memcpy(record.payload + known, reinterpret_cast<const uint8_t*>(&fallback) + known, sizeof record.payload - known);
}
}  // namespace

bool is_name(const char* name) {
  uint8_t length = 0;
  while (length < kNameSize && name[length] != '\0') {
    const char c = name[length++];
    const bool good = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    if (!good) return false;
  }
  for (uint8_t i = length; i < kNameSize; ++i) {
    if (name[i] != '\0') return false;
  }
  return length > 0;
}

uint32_t sequence_of(uint8_t slot) {
  uint32_t sequence;
  read_bytes(slot_address(slot) + offsetof(Record, sequence), &sequence, sizeof sequence);
  return sequence;
}

uint8_t payload_size(uint8_t format) {
  uint8_t size = 0;
  for (const ParameterDescriptor& row : kParameterDescriptors) {
    if (flash_byte(&row.since) <= format) size += flash_byte(&row.width);
  }
  return size;
}

bool read_record(uint8_t slot, Record& record) {
  const uint16_t address = slot_address(slot);
  read_bytes(address, &record, kHeadBytes);
  if (record.mark != kRecordValid || record.format == 0 || record.format > kStorageFormat) return false;
  const uint8_t size = payload_size(record.format);
  uint16_t stored;
  read_bytes(address + kHeadBytes, record.payload, size);
  read_bytes(address + kHeadBytes + size, &stored, sizeof stored);
  if (crc16(bytes_of(record) + 1, kHeadBytes - 1 + size) != stored) return false;
  if (record.sequence > kSequenceLimit) return false;
  if (!is_name(record.name) && memcmp(record.name, kSettingsName, kNameSize) != 0) return false;
  if (record.format < kStorageFormat) migrate(record, record.format);
  seal(record);
  return true;
}

void seal(Record& record) {
  record.mark = kRecordValid;
  record.format = kStorageFormat;
  record.check = crc16(bytes_of(record) + 1, offsetof(Record, check) - 1);
}

bool is_written(uint8_t slot) {
  const uint16_t address = slot_address(slot);
  return eeprom_read(address) == kRecordValid && eeprom_read(address + offsetof(Record, format)) != kRecordVoid;
}

bool is_from_the_future(uint8_t slot) {
  const uint8_t format = eeprom_read(slot_address(slot) + 1);
  return eeprom_read(slot_address(slot)) == kRecordValid && format > kStorageFormat && format != 0xFF;
}

}  // namespace bifa
