// The analog inputs: a round of single conversions, one starting the next, entirely in interrupts.
#pragma once

namespace board {

void converter_begin();

/// Starts a round; on_round() is called at its end, and the strobe falls.
void converter_begin_round();

}  // namespace board
