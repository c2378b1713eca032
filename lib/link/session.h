// The Uno's end of a session: every command is executed once and in order, and answered.
#pragma once

#include "commands.h"
#include "frame.h"

namespace bifa {

/// The port's counters, up to 65535.
struct LinkCounters {
  uint16_t frames_bad;
  uint16_t bytes_lost;
};

class Session {
 public:
  explicit Session(Commands& commands) : commands_(commands) {}

  /// `boot_nonce` differs from start to start.
  void begin(uint16_t boot_nonce, StartCause cause) {
    boot_nonce_ = boot_nonce;
    cause_ = cause;
  }

  /// Seed for the checks of this session's messages.
  uint32_t seed() const { return session_seed(key_); }

  // Not inlined: their stack frames would otherwise add to everything that the main loop calls.

  /// Handles a frame whose checks match; `counters` are reported in status.
  __attribute__((noinline)) void take(const Frame& frame, const LinkCounters& counters);

  /// Answers the pending EEPROM command once it is finished.
  void poll();

  /// Sends a sample if streaming is on and there is room.
  __attribute__((noinline)) void sample(const Sample& sample);

  uint16_t repeated() const { return repeated_; }
  uint16_t boot_nonce() const { return boot_nonce_; }
  StartCause cause() const { return cause_; }

 private:
  static const uint8_t kRemembered = 4;  ///< results kept for repeated commands: the size of the host's window

  void hello();
  void connect(const Frame& frame);
  void in_order(const Frame& frame, const LinkCounters& counters);
  /// Answers a command that only reads data, with that data, as often as it is sent.
  bool query(const Frame& frame, const LinkCounters& counters);
  void send(MessageId message, uint8_t sequence, const void* fields, uint8_t size);
  void done(uint8_t sequence);

  // One for each message of the schema; those answered by a report come first.
  template <typename Handler, typename... About>
  friend bool answer(MessageId, const uint8_t*, Handler&, const About&...);
  template <typename Handler>
  friend Result carry_out(MessageId, const uint8_t*, Handler&);
  void on_status(uint8_t sequence, const LinkCounters& counters);
  void on_presets(const PresetsMessage& fields, uint8_t sequence, const LinkCounters& counters);
  void on_read_set(uint8_t sequence, const LinkCounters& counters);
  void on_read_clock(uint8_t sequence, const LinkCounters& counters);
  Result on_run() { return commands_.run(); }
  Result on_stop() { return commands_.stop(); }
  Result on_hold(const HoldMessage& fields) { return commands_.hold(fields.chamber, fields.state); }
  Result on_clear() { return commands_.clear(); }
  Result on_stream(const StreamMessage& fields);
  Result on_save(const SaveMessage& fields);
  Result on_load(const LoadMessage& fields);
  Result on_forget(const ForgetMessage& fields);
  Result on_defaults() { return commands_.defaults(); }
  Result on_zero(const ZeroMessage& fields) { return commands_.zero(fields.factory != 0); }
  Result on_begin() { return commands_.begin_set(); }
  Result on_field(const FieldMessage& fields) { return commands_.field(fields.parameter, fields.value); }
  Result on_commit(const CommitMessage& fields) { return commands_.commit(fields.check); }
  Result on_schedule_clear() { return commands_.schedule_clear(); }
  Result on_schedule_add(const ScheduleAddMessage& fields) {
    return commands_.schedule_add(fields.time_ms, fields.chamber, fields.state);
  }
  Result on_schedule_start() { return commands_.schedule_start(); }
  Result on_mark();

  Commands& commands_;
  uint16_t boot_nonce_ = 0;
  StartCause cause_ = StartCause::kPower;
  uint16_t key_ = 0;  ///< 0: no session is open
  uint8_t expected_ = 0;
  Result results_[kRemembered];
  bool waiting_ = false;  ///< for the EEPROM; the pending command is the one before `expected_`
  bool streaming_ = false;
  uint16_t repeated_ = 0;
};

}  // namespace bifa
