// The analog inputs: a round of single conversions, each starting the next, entirely in interrupts.
#pragma once

namespace board {

void converter_begin();

/// Starts a round, at whose end the strobe falls.
void converter_begin_round();

/// Called every millisecond: calls on_round() if a round has ended.
void converter_tick();

}  // namespace board
