// Measures a step in CPU cycles with timer 1, on the (simulated) chip, over kSteps steps; `result` is read from outside.
#pragma once

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdint.h>

const uint16_t kSteps = 10240;

struct Result {
  uint16_t least;
  uint16_t most;
  uint32_t sum;
};

extern "C" {
Result result __attribute__((used));
}

inline uint16_t now() { return TCNT1; }

/// Runs `before` (not counted) and `step` (counted) for each step, then sleeps for good.
template <typename Before, typename Step>
void measure(Before before, Step step) {
  TCCR1B = 1 << CS10;
  const uint16_t start = now();
  const uint16_t nothing = now() - start;
  result.least = 0xFFFF;
  for (uint16_t n = 0; n < kSteps; ++n) {
    before(n);
    const uint16_t begin = now();
    step();
    const uint16_t cycles = now() - begin - nothing;
    if (cycles < result.least) result.least = cycles;
    if (cycles > result.most) result.most = cycles;
    result.sum += cycles;
  }
  cli();
  sleep_mode();
}
