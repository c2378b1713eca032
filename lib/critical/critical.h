// What the main loop and the interrupts share is touched under this guard.
#pragma once

#include <stdint.h>

#define BIFA_AT_ONCE inline __attribute__((always_inline))

namespace bifa {

/// Keeps interrupts off for as long as it lives; nests. Keep it short: a stop byte waits meanwhile.
class Critical {
 public:
#ifdef __AVR__
  BIFA_AT_ONCE Critical() : status_(status()) { __builtin_avr_cli(); }
  BIFA_AT_ONCE ~Critical() { status() = status_; }
  Critical(const Critical&) = delete;
  Critical& operator=(const Critical&) = delete;

 private:
  BIFA_AT_ONCE static volatile uint8_t& status() { return *reinterpret_cast<volatile uint8_t*>(0x5F); }  // SREG
  const uint8_t status_;
#else
  Critical() {}
  ~Critical() {}
#endif
};

}  // namespace bifa
