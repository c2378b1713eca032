// RUN_SUITE(run): the program around a Unity suite, for this computer and for the (simulated) Uno.
//
//   #include <unity.h>     // needed here: PlatformIO looks for libraries in the suite's own includes
//   #include "suite.h"
//   static void run() { RUN_TEST(...); }
//   RUN_SUITE(run)
#pragma once

#include <unity.h>

#ifdef ARDUINO

#include <Arduino.h>
#include <avr/sleep.h>

// Sleeping with interrupts disabled never ends: simavr exits there, a real Uno waits for a reset.
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

// PlatformIO reads the results from the output; it would interpret a count of failures as a signal number.
#define RUN_SUITE(run) \
  int main() {         \
    UNITY_BEGIN();     \
    run();             \
    UNITY_END();       \
    return 0;          \
  }

#endif
