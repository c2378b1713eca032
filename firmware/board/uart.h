// The serial port at 250000 baud: every byte received goes to on_byte(), bytes to be sent wait in a ring buffer.
#pragma once

namespace board {

void uart_begin();

}  // namespace board
