// Why the chip started, and the watchdog that may restart it.
#pragma once

#include "controller.h"

namespace board {

bifa::StartCause start_cause();

/// A number that differs from start to start.
uint16_t boot_nonce();

/// From now on watchdog_feed() must be called every 0.2 s, or the valves are switched off and the chip restarts.
void watchdog_begin();
/// Called in the main loop. Feeds only if a complete tick has run since the last feed, so that both must be alive to
/// keep the valves on.
void watchdog_feed();
/// Called in the tick's interrupt, even if a previous tick is still running.
void watchdog_tick();
/// Called at the end of each tick.
void watchdog_ticked();

}  // namespace board
