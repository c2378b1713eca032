// One record in EEPROM: a preset or the settings, with everything needed to validate it.
#pragma once

#include "eeprom.h"
#include "parameters.h"

namespace bifa {

const uint8_t kNameSize = 12;   ///< longest name; shorter ones are padded with zeros
const uint8_t kSlotBytes = 48;  ///< bytes from one record to the next
const uint8_t kSlotCount = kEepromBytes / kSlotBytes;
const uint8_t kRecordValid = 0xA5;  ///< the mark of a complete record, written last
const uint8_t kRecordVoid = 0x00;

extern const char kSettingsName[kNameSize + 1];  ///< not a valid name for a preset
/// Sequence numbers above this are invalid: the cells wear out long before reaching it.
const uint32_t kSequenceLimit = 0xFFFFFF00UL;

/// A record as stored in EEPROM, in the present format. In an older format the payload ends earlier.
struct Record {
  uint8_t mark;
  uint8_t format;
  uint32_t sequence;  ///< the greatest is the newest
  char name[kNameSize];
  uint8_t payload[sizeof(ParameterSet)];
  uint16_t check;  ///< CRC-16 of everything between mark and check
} __attribute__((packed));
static_assert(sizeof(Record) <= kSlotBytes, "a record fits its slot");

inline uint16_t slot_address(uint8_t slot) { return static_cast<uint16_t>(slot) * kSlotBytes; }

/// Whether `name` may be given to a preset: 1 to 12 of a-z, 0-9, _ and -, zero-padded.
bool is_name(const char* name);

/// The sequence number in a slot, regardless of its other contents.
uint32_t sequence_of(uint8_t slot);

/// Bytes of a parameter set in a storage format.
uint8_t payload_size(uint8_t format);

/// Reads a slot into `record`, converted to the present format: fields that an older format lacks take their defaults.
/// Returns false unless mark, format, CRC, name and sequence are valid.
bool read_record(uint8_t slot, Record& record);

/// Sets format, mark and CRC of a record whose sequence, name and payload are set.
void seal(Record& record);

/// Whether a slot is neither blank nor voided. Either of two bytes voids it, in case the mark's cell is stuck.
bool is_written(uint8_t slot);

/// Whether a slot holds a record of a later format than this firmware knows; such records are left alone.
bool is_from_the_future(uint8_t slot);

}  // namespace bifa
