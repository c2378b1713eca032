#include "host_port.h"

#include "critical.h"

namespace bifa {

void HostPort::begin(uint16_t boot_nonce, StartCause cause) {
  commands_.begin(cause);
  session_.begin(boot_nonce, cause);
  console_.greet();
}

void HostPort::poll() {
  commands_.poll();
  session_.poll();
  console_.poll({frames_bad_, receiver_.lost()});
  uint8_t byte;
  // A bounded number of bytes, so that a flood does not starve telemetry and EEPROM writes; and at most one line, whose
  // answer may take a twentieth of a second, so that the watchdog is fed in time.
  for (uint8_t budget = 32; budget > 0 && !console_.waiting() && next(byte); --budget) {
    take(byte);
    if (!in_frame_ && (byte == '\n' || byte == '\r')) break;
  }
  if (receiver_.overrun() && !receiver_.has_input()) recover();
  Sample sample;
  if (!commands_.controller().take_sample(sample)) return;
  commands_.follow(sample);
  session_.sample(sample);
  console_.sample(sample);
}

/// Takes the next byte; if it arrived after the last stop or fault, so did the command that it completes.
bool HostPort::next(uint8_t& byte) {
  {
    const Critical guard;
    if (!receiver_.outdated()) commands_.controller().hear_from_now_on();
  }
  return receiver_.pop(byte);
}

void HostPort::take(uint8_t byte) {
  const bool delimiter = byte == 0;
  if (!delimiter) {
    if (in_frame_) {
      decoder_.feed(byte);
    } else {
      console_.feed(byte);
    }
    return;
  }
  in_frame_ = !in_frame_;
  if (in_frame_) {
    decoder_.start();
  } else if (decoder_.finish(session_.seed())) {
    commands_.controller().host_heard();
    session_.take(decoder_.frame(), {frames_bad_, receiver_.lost()});
  } else {
    console_.spoil_begun();
    if (frames_bad_ != 0xFFFF) ++frames_bad_;
  }
}

void HostPort::recover() {
  console_.spoil();
  decoder_.start();
  const Critical guard;
  in_frame_ = receiver_.recover();
}

}  // namespace bifa
