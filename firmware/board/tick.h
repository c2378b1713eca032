// Timer 1: the millisecond, and on D10 (OC1B) the strobe whose edge the timer itself makes, free of jitter.
#pragma once

namespace board {

void tick_begin();

/// The strobe falls.
void strobe_end();

}  // namespace board
