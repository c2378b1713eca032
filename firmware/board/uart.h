// The serial port at 250000 baud: every byte that arrives goes to on_byte(), what is sent waits in a ring.
#pragma once

#include "sink.h"

namespace board {

class Uart : public bifa::Sink {
 public:
  void begin();
  void write(uint8_t byte) override;
  uint8_t room() const override;
};

}  // namespace board
