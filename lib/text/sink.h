// Where text and frames go out.
#pragma once

#include <stdint.h>

namespace bifa {

/// Takes bytes for the host, in order.
class Sink {
 public:
  /// Sends one byte; waits while there is no room.
  virtual void write(uint8_t byte) = 0;
  /// How many bytes can be written at once without waiting.
  virtual uint8_t room() const = 0;

 protected:
  ~Sink() = default;
};

}  // namespace bifa
