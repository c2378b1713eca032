// Everything behind the serial port: tells text from frames, feeds the console and the session, keeps the store going.
//
// The board calls byte_in_interrupt(), tick_in_interrupt() and, as often as it can, poll(); that is all there is to it.
#pragma once

#include "console.h"
#include "receiver.h"
#include "session.h"

namespace bifa {

class HostPort {
 public:
  explicit HostPort(Controller& controller)
      : commands_(controller), session_(commands_), console_(commands_, session_) {}

  /// Loads what is in EEPROM, starts the controller and greets. `boot_nonce` differs from that of the last start.
  void begin(uint16_t boot_nonce, StartCause cause);

  /// In the receive interrupt. If the byte asks for a stop all valves are off on return.
  void byte_in_interrupt(uint8_t byte, bool damaged = false) {
    if (receiver_.push(byte, damaged)) commands_.controller().stop_in_interrupt();
  }
  /// In the interrupt of the 1 kHz timer.
  void tick_in_interrupt() { receiver_.tick(); }
  /// Commands that wait came before a stop or a fault, which they must not undo; call it with interrupts off.
  void outdate() { receiver_.outdate(); }

  /// In the main loop: handles what has arrived, answers, sends telemetry, goes on writing the EEPROM.
  void poll();

  /// Whether poll() has something to do at once, so that the board must not go to sleep.
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
