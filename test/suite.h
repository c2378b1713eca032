// RUN_SUITE(run): the program around a Unity suite, on this computer and in the (simulated) Uno alike.
//
//   #include <unity.h>     // here too: PlatformIO looks for libraries in the suite's own includes
//   #include "suite.h"
//   static void run() { RUN_TEST(...); }
//   RUN_SUITE(run)
#pragma once

#include <unity.h>

#ifdef ARDUINO

#include <Arduino.h>
#include <avr/sleep.h>

// Asleep without interrupts nothing can happen any more: simavr ends there, a real Uno waits for its reset.
#define RUN_SUITE(run) \
  void setup() {       \
    UNITY_BEGIN();     \
    run();             \
    UNITY_END();       \
    Serial.flush();    \
  }                    \
  void loop() {        \
    cli();             \
    sleep_mode();      \
  }

#else

// PlatformIO reads the results from the output; it would take a count of failures for the number of a signal.
#define RUN_SUITE(run) \
  int main() {         \
    UNITY_BEGIN();     \
    run();             \
    UNITY_END();       \
    return 0;          \
  }

#endif
