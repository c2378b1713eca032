// The store on a fake EEPROM: writes take time, wear is counted, cells may be stuck and the power may fail.
#include <stdlib.h>

#include "store.h"

namespace {

class FakeEeprom {
 public:
  uint8_t read(uint16_t address) const { return bytes[address]; }
  bool busy() {
    if (busy_polls > 0) --busy_polls;
    return busy_polls > 0 || powerless;
  }
  void write(uint16_t address, uint8_t value) {
    if (powerless) return;
    ++writes;
    ++wear[address];
    busy_polls = 3;
    if (cut_at == writes) {
      // The power fails while the cell changes: the caller chooses the value that it is left with.
      if (cut_leaves >= 0) bytes[address] = static_cast<uint8_t>(cut_leaves);
      if (cut_leaves == -2) bytes[address] = value;
      powerless = true;
      return;
    }
    bytes[address] = (stuck[address] & 0x100) ? static_cast<uint8_t>(stuck[address]) : value;
  }

  uint8_t bytes[bifa::kEepromBytes];
  uint32_t wear[bifa::kEepromBytes] = {};
  uint16_t stuck[bifa::kEepromBytes] = {};
  uint32_t writes = 0;
  uint32_t cut_at = 0;  // number of the write that fails; 0: none
  int cut_leaves = -1;  // -1: the old value, -2: the new one, otherwise this byte
  bool powerless = false;
  int busy_polls = 0;
};

struct Bench {
  FakeEeprom eeprom;
  bifa::Store stored;

  /// The store, after connecting it to this bench's EEPROM.
  bifa::Store& store();
};

FakeEeprom* in_place = nullptr;

bifa::Store& Bench::store() {
  in_place = &eeprom;
  return stored;
}

}  // namespace

uint8_t bifa::eeprom_read(uint16_t address) { return in_place->read(address); }
void bifa::eeprom_write(uint16_t address, uint8_t value) { in_place->write(address, value); }
bool bifa::eeprom_busy() { return in_place->busy(); }

extern "C" {

Bench* bench_new(const uint8_t* image) {
  Bench* bench = new Bench;
  memcpy(bench->eeprom.bytes, image, bifa::kEepromBytes);
  bench->store().begin();
  return bench;
}
void bench_free(Bench* bench) { delete bench; }
void bench_image(Bench* bench, uint8_t* image) { memcpy(image, bench->eeprom.bytes, bifa::kEepromBytes); }
void bench_cut(Bench* bench, uint32_t at, int leaves) {
  bench->eeprom.cut_at = at ? bench->eeprom.writes + at : 0;
  bench->eeprom.cut_leaves = leaves;
}
void bench_stick(Bench* bench, uint16_t address, uint8_t value) { bench->eeprom.stuck[address] = 0x100 | value; }
uint32_t bench_writes(Bench* bench) { return bench->eeprom.writes; }
uint32_t bench_wear(Bench* bench, uint16_t address) { return bench->eeprom.wear[address]; }

// Polls until the store has finished, repairs included; returns its result, or -1 if the power failed.
int bench_finish(Bench* bench) {
  for (uint32_t idle = 0, before = bench->eeprom.writes; idle < 200; ++idle) {
    if (bench->eeprom.powerless) return -1;
    bench->store().poll();
    if (bench->eeprom.writes != before || bench->store().busy()) idle = 0;
    before = bench->eeprom.writes;
  }
  return static_cast<int>(bench->store().result());
}
int bench_save(Bench* bench, const char* name, const void* set) {
  return static_cast<int>(bench->store().save(name, *static_cast<const bifa::ParameterSet*>(set)));
}
int bench_save_settings(Bench* bench, const uint8_t* payload) {
  return static_cast<int>(bench->store().save_settings(payload));
}
int bench_forget(Bench* bench, const char* name) { return static_cast<int>(bench->store().forget(name)); }
int bench_erase(Bench* bench) { return static_cast<int>(bench->store().erase_all()); }
int bench_load(Bench* bench, const char* name, void* set) {
  return bench->store().load(name, *static_cast<bifa::ParameterSet*>(set));
}
int bench_load_settings(Bench* bench, uint8_t* payload) { return bench->store().load_settings(payload); }
int bench_name_at(Bench* bench, uint8_t index, char* name) { return bench->store().name_at(index, name); }
}
