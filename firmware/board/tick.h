// Timer 1: the millisecond tick, and the strobe on D10 (OC1B), whose edge the timer hardware sets, free of jitter.
#pragma once

namespace board {

void tick_begin();

/// Ends the strobe's pulse.
void strobe_end();

}  // namespace board
