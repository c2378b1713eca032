// Arbitrary EEPROM contents at start: loaded parameters are within their ranges, and a save works afterwards.
#include <stdlib.h>

#include "board_harness.cpp"
#include "crc.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Board board;
  uint8_t* cells = board.cells;
  memcpy(cells, data, size < sizeof board.cells ? size : sizeof board.cells);
  // Half of the records get a correct CRC, so that the checks after it are exercised as well.
  for (uint8_t slot = 0; slot < bifa::kSlotCount; ++slot) {
    uint8_t* record = cells + bifa::slot_address(slot);
    if (record[0] % 2 == 0) continue;
    record[0] = bifa::kRecordValid;
    record[1] = 1 + record[1] % 3;
    const uint8_t bytes = 17 + bifa::payload_size(record[1] < 3 ? record[1] : 2);
    const uint16_t check = bifa::crc16(record + 1, bytes);
    memcpy(record + 1 + bytes, &check, sizeof check);
  }
  bifa::Store store;
  const auto poll = [&] {
    for (uint32_t i = 0; i < 5000; ++i) {
      board.cells_busy_ms = 0;
      store.poll();
    }
  };
  store.begin();
  const uint8_t names = store.count();
  for (uint8_t i = 0; i < names; ++i) {
    char name[bifa::kNameSize + 1];
    bifa::ParameterSet set;
    if (!store.name_at(i, name) || !bifa::is_name(name)) abort();
    if (store.load(name, set) && !bifa::is_valid(set)) abort();
  }
  poll();
  const char name[bifa::kNameSize + 1] = "fuzz";
  bifa::ParameterSet set = bifa::factory_preset(1);
  set.period_us = 1234567;
  if (store.save(name, set) != bifa::Result::kOk) return 0;  // no room: presets, or a later firmware's records
  poll();
  if (store.busy()) abort();
  if (store.result() != bifa::Result::kOk) return 0;
  bifa::ParameterSet read;
  bifa::Store again;
  again.begin();
  if (!again.load(name, read) || read.period_us != 1234567) abort();
  return 0;
}
