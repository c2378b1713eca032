// The output to the host. There is only one, selected at link time: the board defines these functions.
#pragma once

#include <stdint.h>

namespace bifa {

/// Sends one byte; blocks while there is no room.
void output(uint8_t byte);
/// How many bytes can be sent without blocking.
uint8_t output_room();

}  // namespace bifa
