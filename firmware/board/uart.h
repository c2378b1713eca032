// The serial port at 250000 baud: every byte that arrives goes to on_byte(), what is sent waits in a ring.
#pragma once

namespace board {

void uart_begin();

}  // namespace board
