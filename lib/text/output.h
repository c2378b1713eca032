// The line to the host. There is one, and which it is is settled when the image is linked: the board provides these.
#pragma once

#include <stdint.h>

namespace bifa {

/// Sends one byte; waits while there is no room.
void output(uint8_t byte);
/// How many bytes can be sent at once without waiting.
uint8_t output_room();

}  // namespace bifa
