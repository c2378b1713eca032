// What the main loop and the interrupts share is touched under this guard.
#pragma once

#include <stdint.h>

namespace bifa {

/// Keeps interrupts off for as long as it lives; nests. Keep it short: a stop byte waits meanwhile.
class Critical {
 public:
#ifdef __AVR__
  Critical() : status_(status()) { __builtin_avr_cli(); }
  ~Critical() { status() = status_; }
  Critical(const Critical&) = delete;
  Critical& operator=(const Critical&) = delete;

 private:
  static volatile uint8_t& status() { return *reinterpret_cast<volatile uint8_t*>(0x5F); }  // SREG
  const uint8_t status_;
#else
  Critical() {}
  ~Critical() {}
#endif
};

}  // namespace bifa
