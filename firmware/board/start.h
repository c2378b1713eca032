// Why the chip started, and the watchdog that may start it again.
#pragma once

#include "controller.h"

namespace board {

bifa::StartCause start_cause();

/// A number that differs from start to start.
uint16_t boot_nonce();

/// From now on the main loop must call watchdog_feed() at least every half second.
void watchdog_begin();
void watchdog_feed();

}  // namespace board
