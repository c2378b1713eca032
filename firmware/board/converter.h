// The analog inputs: a round of single conversions, one starting the next, entirely in interrupts.
#pragma once

namespace board {

void converter_begin();

/// Starts a round. At its end the strobe falls.
void converter_begin_round();

/// Every millisecond: calls on_round() if a round has ended.
void converter_tick();

}  // namespace board
