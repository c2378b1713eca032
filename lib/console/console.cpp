#include "console.h"

#include "decimal.h"
#include "output.h"

namespace bifa {

namespace {
const char kBackspace = 0x08;
const char kDelete = 0x7F;
// A frame of telemetry (31 bytes) may stand in the ring already; what lacks then for a long line takes 1.2 ms.
const uint8_t kRoomForSample = 60;

FlashText usage_of(uint8_t command) { return flash_text(kCommandTexts, 2 * command); }
FlashText help_of(uint8_t command) { return flash_text(kCommandTexts, 2 * command + 1); }
FlashText name_of(ParameterId id) { return text_of(id, ParameterText::kName); }
/// The command whose usage begins with that word; kCommandCount if there is none.
uint8_t find_command(const char* name) {
  for (uint8_t i = 0; i < kCommandCount; ++i) {
    const char* usage = reinterpret_cast<const char*>(usage_of(i));
    const char* given = name;
    while (*given != '\0' && static_cast<char>(flash_byte(usage)) == *given) {
      ++usage;
      ++given;
    }
    const char next = static_cast<char>(flash_byte(usage));
    if (*given == '\0' && given != name && (next == ' ' || next == '\0')) return i;
  }
  return kCommandCount;
}
/// Whether a command takes so many words, itself included, as its usage shows.
bool takes_words(uint8_t command, uint8_t count) {
  uint8_t most = 1, optional = 0;
  for (const char* at = reinterpret_cast<const char*>(usage_of(command)); flash_byte(at) != '\0'; ++at) {
    if (flash_byte(at) == ' ') ++most;
    if (flash_byte(at) == '[') ++optional;
  }
  return count <= most && count + optional >= most;
}
uint8_t decimals_of(ParameterId id) { return flash_byte(&descriptor(id).decimals); }
}  // namespace

void Console::greet() {
  version();
  print(BIFA_TEXT("[type help\n"));
}

void Console::feed(uint8_t byte) {
  const char c = static_cast<char>(byte);
  if (c == '\r') {
    // Many terminals send only this for the Enter key; programs send it before the line feed.
    if (!echo_) return;
    after_return_ = true;
    end_line();
    return;
  }
  if (c == '\n') {
    if (!after_return_) end_line();
    after_return_ = false;
    return;
  }
  after_return_ = false;
  if (c == kBackspace || c == kDelete) {
    if (length_ == 0) return;
    --length_;
    if (echo_) print(BIFA_TEXT("\b \b"));
    return;
  }
  if (c == '\t' || (c >= ' ' && c <= '~')) {
    if (length_ == kLongestLine) {
      too_long_ = true;
      return;
    }
    line_[length_++] = c;
    if (echo_) print(c);
    return;
  }
  spoilt_ = true;
}

void Console::end_line() {
  if (echo_) print('\n');
  line_[length_] = '\0';
  length_ = 0;
  if (spoilt_) {
    print(BIFA_TEXT("error the line arrived damaged\n"));
  } else if (too_long_) {
    print(BIFA_TEXT("error the line exceeds 63 characters\n"));
  } else {
    execute();
  }
  spoilt_ = too_long_ = false;
}

void Console::execute() {
  word_count_ = 0;
  for (char* at = line_; *at != '\0';) {
    while (*at == ' ' || *at == '\t') *at++ = '\0';
    if (*at == '\0') break;
    if (word_count_ == kWords) {
      ++word_count_;  // one too many for any command
      break;
    }
    words_[word_count_++] = at;
    while (*at != '\0' && *at != ' ' && *at != '\t') ++at;
  }
  if (word_count_ == 0) return answer(Result::kOk);
  const uint8_t command = find_command(words_[0]);
  if (command < kCommandCount) {
    commands_.controller().host_heard();
    return dispatch(static_cast<CommandId>(command));
  }
  answer(Result::kUnknown);
}

bool Console::is(uint8_t word, FlashText text) const {
  return flash_equal(words_[word], reinterpret_cast<const char*>(text));
}

void Console::dispatch(CommandId id) {
  if (!takes_words(static_cast<uint8_t>(id), word_count_)) return answer_usage(id);
  switch (id) {
    case CommandId::kHelp:
      return word_count_ == 1 ? help() : help_on(words_[1]);
    case CommandId::kVersion:
      version();
      return answer(Result::kOk);
    case CommandId::kStatus:
      status();
      return answer(Result::kOk);
    case CommandId::kShow:
      return show();
    case CommandId::kSet:
      return set();
    case CommandId::kRun:
      return answer(commands_.run());
    case CommandId::kStop:
      return answer(commands_.stop());
    case CommandId::kHold:
      return hold();
    case CommandId::kClear:
      return answer(commands_.clear());
    case CommandId::kStream:
      return switch_to(id, streaming_);
    case CommandId::kPlot:
      return switch_to(id, plotting_);
    case CommandId::kEcho:
      return switch_to(id, echo_);
    case CommandId::kSave:
      return with_preset(&Commands::save);
    case CommandId::kLoad:
      return with_preset(&Commands::load);
    case CommandId::kForget:
      return with_preset(&Commands::forget);
    case CommandId::kPresets:
      return presets();
    case CommandId::kDefaults:
      if (!is(1, BIFA_TEXT("confirm"))) break;
      return finish_later(commands_.defaults());
    case CommandId::kZero:
      if (is(1, BIFA_TEXT("confirm"))) return zero(false);
      if (is(1, BIFA_TEXT("factory"))) return zero(true);
      break;
  }
  answer_usage(id);
}

void Console::answer(Result result) {
  if (result != Result::kOk) print(BIFA_TEXT("error "));
  print(flash_text(kResultTexts, static_cast<uint8_t>(result)));
  print('\n');
}

void Console::answer_usage(CommandId id) {
  print(BIFA_TEXT("error usage: "));
  print(usage_of(static_cast<uint8_t>(id)));
  print('\n');
}

void Console::finish_later(Result started) {
  if (started == Result::kOk && commands_.store().busy()) {
    waiting_ = true;
  } else {
    answer(started);
  }
}

void Console::poll(const LinkCounters& counters) {
  counters_ = counters;
  const State state = commands_.controller().state();
  if (state != last_state_) {
    last_state_ = state;
    if (state == State::kStopped) print(BIFA_TEXT("[stopped: all valves off until clear\n"));
    if (state == State::kFault) print_fault(commands_.controller().status().fault);
  }
  if (!waiting_ || commands_.store().busy()) return;
  waiting_ = false;
  answer(commands_.store().result());
}

void Console::switch_to(CommandId id, bool& flag) {
  const bool on = is(1, BIFA_TEXT("on"));
  if (!on && !is(1, BIFA_TEXT("off"))) return answer_usage(id);
  flag = on;
  if (on && id == CommandId::kStream) {
    print(BIFA_TEXT("[>sequence,time_us,state,psi body,head,tail,command body,head,tail,phase_deg body,head,tail\n"));
  }
  answer(Result::kOk);
}

void Console::help() {
  for (uint8_t i = 0; i < kCommandCount; ++i) print_help(usage_of(i), help_of(i));
  print(BIFA_TEXT("[!  (at any time, no Enter) stop: all chambers vent until clear\n[parameters:"));
  for (uint8_t i = 0; i < kParameterCount; ++i) {
    print(' ');
    print(name_of(static_cast<ParameterId>(i)));
  }
  print(BIFA_TEXT("\n[try: set period_s 6, run, help run\n"));
  answer(Result::kOk);
}

void Console::print_help(FlashText name, FlashText text) {
  print('[');
  print(name);
  print(BIFA_TEXT("  "));
  print(text);
  print('\n');
}

void Console::help_on(const char* name) {
  ParameterId id;
  if (find_parameter(name, id)) {
    print_help(name_of(id), text_of(id, ParameterText::kHelp));
    print(BIFA_TEXT("[range "));
    print_range(id);
    print(BIFA_TEXT(", default "));
    print_decimal(value_of(factory_preset(0), id), decimals_of(id));
    print(BIFA_TEXT(", now "));
    print_decimal(value_of(commands_.wanted(), id), decimals_of(id));
    print('\n');
    return answer(Result::kOk);
  }
  const uint8_t command = find_command(name);
  if (command < kCommandCount) {
    print_help(usage_of(command), help_of(command));
    return answer(Result::kOk);
  }
  answer(Result::kUnknown);
}

void Console::print_range(ParameterId id) {
  print_decimal(minimum_of(id), decimals_of(id));
  print(BIFA_TEXT(" to "));
  print_decimal(maximum_of(id), decimals_of(id));
  const FlashText unit = text_of(id, ParameterText::kUnit);
  if (flash_byte(unit) != 0) print(' ');
  print(unit);
}

void Console::version() {
  print(BIFA_TEXT("[bifa "));
  for (uint8_t i = 0; i < sizeof kFirmwareVersion; ++i) {
    if (i > 0) print('.');
    print_number(kFirmwareVersion[i]);
  }
  print(BIFA_TEXT(", protocol "));
  print_number(kProtocolVersion);
  print(BIFA_TEXT(", table "));
  print_number(kTableHash);
  print(BIFA_TEXT(", started by "));
  print(flash_text(kStartCauseWords, static_cast<uint8_t>(session_.cause())));
  print('\n');
}

void Console::status() {
  const Status status = commands_.controller().status();
  print(BIFA_TEXT("[state "));
  print(flash_text(kStateWords, static_cast<uint8_t>(status.state)));
  if (status.scheduled) print(BIFA_TEXT(", timed holds"));
  if (status.emergency_stop) print(BIFA_TEXT(", emergency stop pressed"));
  print('\n');
  if (status.fault.fault != Fault::kNone) print_fault(status.fault);
  print(BIFA_TEXT("[psi "));
  print_triple(status.pressure_mpsi);
  print(BIFA_TEXT("\n[valves"));
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    print(' ');
    print(flash_text(kChamberWords, i));
    print(' ');
    // the two bits of a chamber, positive and vacuum, in the order of ChamberState
    const uint8_t bits = status.valves >> (2 * i) & 3;
    print(flash_text(kChamberStateWords, bits == 1 ? 2 : bits == 2 ? 1 : 0));
  }
  print(BIFA_TEXT("\n[link: frames bad "));
  print_number(counters_.frames_bad);
  print(BIFA_TEXT(", repeated "));
  print_number(session_.repeated());
  print(BIFA_TEXT(", bytes lost "));
  print_number(counters_.bytes_lost);
  print(BIFA_TEXT(", samples lost "));
  print_number(status.samples_lost);
  print('\n');
}

void Console::print_triple(const int16_t (&pressure_mpsi)[kChamberCount]) {
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    if (i > 0) print(' ');
    print(flash_text(kChamberWords, i));
    print(' ');
    print_signed(pressure_mpsi[i], 3);
  }
}

void Console::print_fault(const FaultReport& fault) {
  print(BIFA_TEXT("[fault "));
  print(flash_text(kFaultWords, static_cast<uint8_t>(fault.fault)));
  if (fault.channel < kChamberCount) {
    print(' ');
    print(flash_text(kChamberWords, fault.channel));
  }
  print(BIFA_TEXT(" value "));
  print_signed(fault.value, 0);
  print(BIFA_TEXT(" limit "));
  print_signed(fault.limit, 0);
  print(BIFA_TEXT(" at_ms "));
  print_number(fault.time_ms);
  print(BIFA_TEXT("\n[the second before, psi from "));
  print_triple(fault.lowest_mpsi);
  print(BIFA_TEXT(" to "));
  print_triple(fault.highest_mpsi);
  print('\n');
}

void Console::show_parameter(ParameterId id) {
  print('[');
  print(name_of(id));
  print(' ');
  print_decimal(value_of(commands_.wanted(), id), decimals_of(id));
  print('\n');
}

void Console::show() {
  ParameterId id;
  if (word_count_ == 2) {
    if (!find_parameter(words_[1], id)) return answer(Result::kNoParameter);
    show_parameter(id);
  } else {
    for (uint8_t i = 0; i < kParameterCount; ++i) show_parameter(static_cast<ParameterId>(i));
  }
  answer(Result::kOk);
}

void Console::set() {
  ParameterId id;
  if (!find_parameter(words_[1], id)) return answer(Result::kNoParameter);
  uint32_t value;
  switch (parse_decimal(words_[2], decimals_of(id), minimum_of(id), maximum_of(id), value)) {
    case DecimalResult::kOk:
      return answer(commands_.set(id, value));
    case DecimalResult::kNotANumber:
      print(BIFA_TEXT("error not a decimal number; "));
      break;
    case DecimalResult::kOutOfRange:
      print(BIFA_TEXT("error out of range; "));
      break;
  }
  print(name_of(id));
  print(BIFA_TEXT(" is "));
  print_range(id);
  print('\n');
}

void Console::hold() {
  for (uint8_t chamber = 0; chamber < kChamberCount; ++chamber) {
    if (!is(1, flash_text(kChamberWords, chamber))) continue;
    for (uint8_t state = 0; state <= static_cast<uint8_t>(ChamberState::kPositive); ++state) {
      if (is(2, flash_text(kChamberStateWords, state))) return answer(commands_.hold(chamber, state));
    }
  }
  answer_usage(CommandId::kHold);
}

void Console::with_preset(Result (Commands::*command)(const char*)) {
  char name[kNameSize + 1] = {};
  if (word_count_ < 2) {
    memcpy(name, kStartPreset, sizeof name);
  } else {
    if (strlen(words_[1]) > kNameSize) return answer(Result::kName);
    strncpy(name, words_[1], kNameSize);
  }
  finish_later((commands_.*command)(name));
}

void Console::zero(bool factory) {
  print_offsets();
  const Result started = commands_.zero(factory);
  if (started == Result::kOk) print_offsets();
  finish_later(started);
}

void Console::print_offsets() {
  print(BIFA_TEXT("[offset psi "));
  print_triple(commands_.controller().calibration().offset_mpsi);
  print('\n');
}

void Console::presets() {
  char name[kNameSize + 1];
  bool stored;
  for (uint8_t i = 0; commands_.preset_at(i, name, stored); ++i) {
    print('[');
    print(name);
    print(stored ? BIFA_TEXT(" saved\n") : BIFA_TEXT(" factory\n"));
  }
  answer(Result::kOk);
}

void Console::sample(const Sample& sample) {
  if (!streaming_ && !plotting_) return;
  // A line is printed whole or not at all, and telemetry makes nothing wait for long.
  if (output_room() < kRoomForSample) return;
  if (streaming_) print_stream(sample);
  if (plotting_) print_plot(sample);
}

void Console::print_stream(const Sample& sample) {
  print('>');
  print_number(sample.sequence);
  print(',');
  print_number(sample.time_us);
  print(',');
  print(flash_text(kStateWords, static_cast<uint8_t>(sample.state)));
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    print(',');
    print_signed(sample.pressure_mpsi[i], 3);
  }
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    print(',');
    print(flash_text(kChamberStateWords, static_cast<uint8_t>(sample.command[i])));
  }
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    print(',');
    print_number(static_cast<uint32_t>(sample.phase[i]) * 360 >> 16);
  }
  print('\n');
}

void Console::print_plot(const Sample& sample) {
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    if (i > 0) print('\t');
    print(flash_text(kChamberWords, i));
    print(BIFA_TEXT("_psi:"));
    print_signed(sample.pressure_mpsi[i], 3);
  }
  print('\n');
}

}  // namespace bifa
