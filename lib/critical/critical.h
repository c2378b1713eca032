// Guard for data shared between the main loop and interrupts.
#pragma once

#include <stdint.h>

#define BIFA_AT_ONCE inline __attribute__((always_inline))

namespace bifa {

/// Keeps interrupts off during its lifetime; nests. Keep it short: a stop byte waits meanwhile. Both ends are compiler
/// barriers; without them the compiler could move plain memory accesses out of the guard.
class Critical {
 public:
#ifdef __AVR__
  BIFA_AT_ONCE Critical() : status_(status()) {
    __builtin_avr_cli();
    barrier();
  }
  BIFA_AT_ONCE ~Critical() {
    barrier();
    status() = status_;
    barrier();
  }
  Critical(const Critical&) = delete;
  Critical& operator=(const Critical&) = delete;

 private:
  BIFA_AT_ONCE static volatile uint8_t& status() { return *reinterpret_cast<volatile uint8_t*>(0x5F); }  // SREG
  BIFA_AT_ONCE static void barrier() { __asm__ volatile("" ::: "memory"); }
  const uint8_t status_;
#else
  // On other machines nothing interrupts; tests check that the guard is used.
  Critical() {
    ++depth();
    ++entered();
  }
  ~Critical() { --depth(); }
  Critical(const Critical&) = delete;
  Critical& operator=(const Critical&) = delete;

  /// How many are alive now.
  static unsigned& depth() {
    static unsigned depth = 0;
    return depth;
  }
  /// How many there have been in total.
  static unsigned& entered() {
    static unsigned entered = 0;
    return entered;
  }
#endif
};

}  // namespace bifa
