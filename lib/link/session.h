// The Uno's end of a session: every command once and in order, every command answered.
#pragma once

#include "commands.h"
#include "frame.h"

namespace bifa {

const uint8_t kFirmwareVersion[3] = {0, 1, 0};

/// What the port counts, up to 65535.
struct LinkCounters {
  uint16_t frames_bad;
  uint16_t bytes_lost;
};

class Session {
 public:
  explicit Session(Commands& commands) : commands_(commands) {}

  /// `boot_nonce` differs from that of the last start.
  void begin(uint16_t boot_nonce, StartCause cause) {
    boot_nonce_ = boot_nonce;
    cause_ = cause;
  }

  /// Seed of the checks of this session's messages.
  uint32_t seed() const { return session_seed(key_); }

  /// A frame whose checks are right; `counters` are reported in status.
  void take(const Frame& frame, const LinkCounters& counters);

  /// Answers the EEPROM command that is being waited for, once it is finished.
  void poll();

  /// Sends a sample if the host wants them, unless there is no room now.
  void sample(const Sample& sample);

  uint16_t repeated() const { return repeated_; }
  uint16_t boot_nonce() const { return boot_nonce_; }
  StartCause cause() const { return cause_; }

 private:
  static const uint8_t kRemembered = 4;  ///< results kept for repeats: the host's window

  void hello();
  void connect(const Frame& frame);
  void in_order(const Frame& frame, const LinkCounters& counters);
  bool query(const Frame& frame, const LinkCounters& counters);
  Result execute(const Frame& frame);
  void send(MessageId message, uint8_t sequence, const void* fields, uint8_t size);
  void done(uint8_t sequence);
  void send_status(uint8_t sequence, const LinkCounters& counters);
  void send_preset(uint8_t sequence, uint8_t index);

  Commands& commands_;
  uint16_t boot_nonce_ = 0;
  StartCause cause_ = StartCause::kPower;
  uint16_t key_ = 0;  ///< 0: no session is open
  uint8_t expected_ = 0;
  Result results_[kRemembered];
  bool waiting_ = false;  ///< for the EEPROM; the command is the one before the expected
  bool streaming_ = false;
  uint16_t repeated_ = 0;
  uint16_t samples_dropped_ = 0;
};

}  // namespace bifa
