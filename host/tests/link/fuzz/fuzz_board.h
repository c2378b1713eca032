// The smallest board around lib/ for the fuzzers.
#pragma once

#include <deque>
#include <string>

#include "crc.h"
#include "host_port.h"
#include "output.h"

static uint8_t cells[bifa::kEepromBytes];
static std::string text;  ///< what came out
static bifa::HostPort* listening;

namespace bifa {
uint8_t eeprom_read(uint16_t address) {
  if (address >= sizeof cells) __builtin_trap();
  return cells[address];
}
void eeprom_write(uint16_t address, uint8_t value) {
  if (address >= sizeof cells) __builtin_trap();
  cells[address] = value;
}
bool eeprom_busy() { return false; }
void output(uint8_t byte) { text.push_back(static_cast<char>(byte)); }
uint8_t output_room() { return 127; }
void set_valves(ValvePattern pattern) {
  const uint8_t bits = pattern.bits();
  if (bits & (bits >> 1) & 0x15) __builtin_trap();  // both valves of a chamber
}
void outdate_input() { listening->outdate(); }
}  // namespace bifa

class FuzzBoard {
 public:
  FuzzBoard() : port(controller) {
    memset(cells, 0xFF, sizeof cells);
    text.clear();
    listening = &port;
    port.begin(1, bifa::StartCause::kPower);
  }

  void send(uint8_t byte) {
    port.byte_in_interrupt(byte);
    if (++sent % 25 == 0) run_ms(1);
  }

  void run_ms(uint32_t duration_ms) {
    for (uint32_t i = 0; i < duration_ms; ++i) {
      port.tick_in_interrupt();
      if (controller.tick(false)) {
        const uint16_t rest = 4096 + ++wobble % 16;
        controller.converted_in_interrupt({{rest, rest, rest}, 0});
      }
      port.poll();
    }
  }

  /// Whether something that adds lines by itself has been switched on.
  bool is_noisy() const { return text.find("[>") != std::string::npos || text.find("_psi:") != std::string::npos; }

  bifa::Controller controller;
  bifa::HostPort port;
  uint32_t sent = 0;
  uint16_t wobble = 0;
};
