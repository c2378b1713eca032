#include "session.h"

#include "output.h"

namespace bifa {

namespace {

/// A preset's name as transmitted, plus a terminating zero.
struct Name {
  char text[kNameSize + 1];
  __attribute__((noinline)) explicit Name(const char* bytes) : text() { memcpy(text, bytes, kNameSize); }
};

void count(uint16_t& counter) {
  if (counter != 0xFFFF) ++counter;
}

}  // namespace

void Session::take(const Frame& frame, const LinkCounters& counters) {
  switch (static_cast<MessageId>(frame.message)) {
    case MessageId::kVersion:
      return hello();
    case MessageId::kConnect:
      return connect(frame);
    case MessageId::kStopNow:
      return;  // executed when it arrived
    default:
      break;
  }
  if (key_ == 0) return;
  const uint8_t ahead = frame.sequence - expected_;
  if (ahead == 0) {
    if (!waiting_) in_order(frame, counters);
    return;
  }
  if (ahead < static_cast<uint8_t>(-kRemembered)) {
    send(MessageId::kExpected, expected_, nullptr, 0);
    return;
  }
  count(repeated_);
  const bool unfinished = waiting_ && ahead == static_cast<uint8_t>(-1);
  if (!unfinished && !query(frame, counters)) done(frame.sequence);
}

void Session::hello() {
  HelloMessage message;
  message.protocol = kProtocolVersion;
  flash_copy(message.firmware, kFirmwareVersion, sizeof message.firmware);
  message.table_hash = kTableHash;
  message.boot_nonce = boot_nonce_;
  message.start_cause = static_cast<uint8_t>(cause_);
  message.session_key = key_;
  send_frame(MessageId::kHello, 0, &message, sizeof message, kOpenSeed);
}

void Session::connect(const Frame& frame) {
  const ConnectMessage wanted = fields_as<ConnectMessage>(frame.fields);
  if (wanted.boot_nonce == boot_nonce_) {
    key_ = wanted.session_key;
    commands_.controller().in_session(key_ != 0);
    expected_ = 0;
    waiting_ = false;
    streaming_ = false;
    commands_.abandon();
  }
  hello();
}

void Session::in_order(const Frame& frame, const LinkCounters& counters) {
  ++expected_;
  if (query(frame, counters)) return;
  Result& result = results_[frame.sequence % kRemembered];
  const bool saves_for_another = commands_.store().busy();  // for the console or an earlier session
  result = carry_out(static_cast<MessageId>(frame.message), frame.fields, *this);
  waiting_ = result == Result::kOk && !saves_for_another && commands_.store().busy();
  if (!waiting_) done(frame.sequence);
}

void Session::poll() {
  if (!waiting_ || commands_.store().busy()) return;
  waiting_ = false;
  const uint8_t sequence = expected_ - 1;
  results_[sequence % kRemembered] = commands_.store().result();
  done(sequence);
}

bool Session::query(const Frame& frame, const LinkCounters& counters) {
  return answer(static_cast<MessageId>(frame.message), frame.fields, *this, frame.sequence, counters);
}

void Session::on_read_set(uint8_t sequence, const LinkCounters&) {
  const SetReportMessage message = {commands_.is_pending(), commands_.wanted()};
  send(MessageId::kSetReport, sequence, &message, sizeof message);
}

void Session::on_read_clock(uint8_t sequence, const LinkCounters&) {
  const ClockReportMessage message = {commands_.controller().uptime_ms() * 1000, commands_.controller().marked()};
  send(MessageId::kClockReport, sequence, &message, sizeof message);
}

Result Session::on_stream(const StreamMessage& fields) {
  streaming_ = fields.on != 0;
  return Result::kOk;
}

Result Session::on_save(const SaveMessage& fields) { return commands_.save(Name(fields.preset).text); }
Result Session::on_load(const LoadMessage& fields) { return commands_.load(Name(fields.preset).text); }
Result Session::on_forget(const ForgetMessage& fields) { return commands_.forget(Name(fields.preset).text); }

Result Session::on_mark() {
  commands_.controller().mark_strobe();
  return Result::kOk;
}

void Session::send(MessageId message, uint8_t sequence, const void* fields, uint8_t size) {
  send_frame(message, sequence, fields, size, seed());
}

void Session::done(uint8_t sequence) {
  const DoneMessage message = {static_cast<uint8_t>(results_[sequence % kRemembered])};
  send(MessageId::kDone, sequence, &message, sizeof message);
}

void Session::on_status(uint8_t sequence, const LinkCounters& counters) {
  const Status status = commands_.controller().status();
  StatusReportMessage message;
  message.state = static_cast<uint8_t>(status.state);
  message.fault = static_cast<uint8_t>(status.fault.fault);
  message.fault_channel = status.fault.channel;
  message.fault_value = status.fault.value;
  message.fault_limit = status.fault.limit;
  message.fault_time_ms = status.fault.time_ms;
  memcpy(message.fault_lowest_mpsi, status.fault.lowest_mpsi, sizeof message.fault_lowest_mpsi);
  memcpy(message.fault_highest_mpsi, status.fault.highest_mpsi, sizeof message.fault_highest_mpsi);
  memcpy(message.pressure_mpsi, status.pressure_mpsi, sizeof message.pressure_mpsi);
  message.valves = status.valves;
  message.flags = (commands_.is_pending() ? 1 : 0) | (status.scheduled ? 2 : 0) | (status.emergency_stop ? 4 : 0);
  message.uptime_ms = status.uptime_ms;
  message.frames_bad = counters.frames_bad;
  message.frames_repeated = repeated_;
  message.bytes_lost = counters.bytes_lost;
  message.samples_lost = status.samples_lost;
  send(MessageId::kStatusReport, sequence, &message, sizeof message);
}

void Session::on_presets(const PresetsMessage& fields, uint8_t sequence, const LinkCounters&) {
  char name[kNameSize + 1];
  bool stored = false;
  PresetReportMessage message = {};
  message.count = commands_.preset_count();
  if (commands_.preset_at(fields.index, name, stored)) memcpy(message.preset, name, sizeof message.preset);
  message.source = stored;
  send(MessageId::kPresetReport, sequence, &message, sizeof message);
}

void Session::sample(const Sample& sample) {
  if (!streaming_) return;
  SampleMessage message;
  if (output_room() < frame_room(sizeof message)) {
    commands_.controller().lose_sample();
    return;
  }
  message.sequence = sample.sequence;
  message.time_us = sample.time_us;
  message.state = static_cast<uint8_t>(sample.state);
  memcpy(message.pressure_mpsi, sample.pressure_mpsi, sizeof message.pressure_mpsi);
  memcpy(message.phase, sample.phase, sizeof message.phase);
  message.command = 0;
  for (uint8_t i = 0; i < kChamberCount; ++i) message.command |= static_cast<uint8_t>(sample.command[i]) << (2 * i);
  message.valves = sample.valves;
  send_frame(MessageId::kSample, static_cast<uint8_t>(sample.sequence), &message, sizeof message, kStreamSeed);
}

}  // namespace bifa
