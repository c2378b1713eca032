// Everything behind the serial port: separates text from frames, feeds the console and the session, and runs the store.
//
// The board only has to call byte_in_interrupt(), tick_in_interrupt() and, as often as it can, poll().
#pragma once

#include "console.h"
#include "receiver.h"
#include "session.h"

namespace bifa {

class HostPort {
 public:
  explicit HostPort(Controller& controller)
      : commands_(controller), session_(commands_), console_(commands_, session_) {}

  /// Loads the EEPROM's contents, starts the controller and prints the greeting. `boot_nonce` differs from start to
  /// start.
  void begin(uint16_t boot_nonce, StartCause cause);

  /// Call in the receive interrupt. If the byte completes a stop, all valves are off on return.
  void byte_in_interrupt(uint8_t byte, bool damaged = false) {
    if (receiver_.push(byte, damaged)) commands_.controller().stop_in_interrupt();
  }
  /// Call in the interrupt of the 1 kHz timer.
  void tick_in_interrupt() { receiver_.tick(); }
  /// Marks waiting commands as older than a stop or fault, which they must not undo; call with interrupts off.
  void outdate() { receiver_.outdate(); }

  /// Call in the main loop: handles received bytes, answers, sends telemetry, continues writing the EEPROM.
  void poll();

  /// Whether poll() has work to do, so that the board must not go to sleep.
  bool has_input() const { return receiver_.has_input(); }

 private:
  bool next(uint8_t& byte);
  void take(uint8_t byte);
  void recover();

  bool in_frame_ = false;
  uint16_t frames_bad_ = 0;
  FrameDecoder decoder_;
  Commands commands_;
  Session session_;
  Console console_;
  Receiver receiver_;
};

}  // namespace bifa
