// The smallest board around lib/ for the fuzzers.
#pragma once

#include <deque>
#include <string>

#include "crc.h"
#include "host_port.h"

class FuzzEeprom : public bifa::Eeprom {
 public:
  FuzzEeprom() { memset(bytes, 0xFF, sizeof bytes); }
  uint8_t read(uint16_t address) override {
    if (address >= sizeof bytes) __builtin_trap();
    return bytes[address];
  }
  void write(uint16_t address, uint8_t value) override {
    if (address >= sizeof bytes) __builtin_trap();
    bytes[address] = value;
  }
  bool busy() override { return false; }
  uint8_t bytes[bifa::kEepromBytes];
};

class FuzzSink : public bifa::Sink {
 public:
  void write(uint8_t byte) override { text.push_back(static_cast<char>(byte)); }
  uint8_t room() const override { return 127; }
  std::string text;
};

class FuzzValves : public bifa::ValvePins {
 public:
  void write(bifa::ValvePattern pattern) override {
    const uint8_t bits = pattern.bits();
    if (bits & (bits >> 1) & 0x15) __builtin_trap();  // both valves of a chamber
  }
};

class FuzzBoard {
 public:
  FuzzBoard() : controller(valves), port(controller, eeprom, sink) { port.begin(1, bifa::StartCause::kPower); }

  void send(uint8_t byte) {
    if (port.byte_in_interrupt(byte)) controller.stop_in_interrupt();
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
  bool is_noisy() const {
    return sink.text.find("[>") != std::string::npos || sink.text.find("_psi:") != std::string::npos;
  }

  FuzzValves valves;
  FuzzEeprom eeprom;
  FuzzSink sink;
  bifa::Controller controller;
  bifa::HostPort port;
  uint32_t sent = 0;
  uint16_t wobble = 0;
};
