// Why the chip started, and the watchdog that may start it again.
#pragma once

#include "controller.h"

namespace board {

bifa::StartCause start_cause();

/// A number that differs from start to start.
uint16_t boot_nonce();

/// From now on watchdog_feed() must be called every 0.2 s, or the valves fall and the chip restarts.
void watchdog_begin();
/// In the main loop. Feeds only if a whole tick has passed since, so that it takes both to keep the valves on.
void watchdog_feed();
/// In the tick's interrupt, whether or not a tick is still under way.
void watchdog_tick();
/// At the end of each tick.
void watchdog_ticked();

}  // namespace board
