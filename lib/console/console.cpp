#include "console.h"

#include "decimal.h"

namespace bifa {

namespace {
const char kBackspace = 0x08;
const char kDelete = 0x7F;
const uint8_t kRoomForSample = 96;

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
uint8_t decimals_of(ParameterId id) { return flash_byte(&descriptor(id).decimals); }
}  // namespace

void Console::greet() {
  version();
  print(out_, BIFA_TEXT("[type help\n"));
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
    if (echo_) print(out_, BIFA_TEXT("\b \b"));
    return;
  }
  if (c == '\t' || (c >= ' ' && c <= '~')) {
    if (length_ == kLongestLine) {
      too_long_ = true;
      return;
    }
    line_[length_++] = c;
    if (echo_) print(out_, c);
    return;
  }
  spoilt_ = true;
}

void Console::end_line() {
  if (echo_) print(out_, '\n');
  line_[length_] = '\0';
  length_ = 0;
  if (spoilt_) {
    print(out_, BIFA_TEXT("error the line arrived damaged\n"));
  } else if (too_long_) {
    print(out_, BIFA_TEXT("error the line is longer than 63 characters\n"));
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
  if (command < kCommandCount) return dispatch(static_cast<CommandId>(command));
  answer(Result::kUnknown);
}

bool Console::is(uint8_t word, FlashText text) const {
  return flash_equal(words_[word], reinterpret_cast<const char*>(text));
}

void Console::dispatch(CommandId id) {
  const uint8_t arguments = word_count_ - 1;
  switch (id) {
    case CommandId::kHelp:
      if (arguments == 0) return help();
      if (arguments == 1) return help_on(words_[1]);
      break;
    case CommandId::kVersion:
      if (arguments > 0) break;
      version();
      return answer(Result::kOk);
    case CommandId::kStatus:
      if (arguments > 0) break;
      status();
      return answer(Result::kOk);
    case CommandId::kShow:
      if (arguments > 1) break;
      return show();
    case CommandId::kSet:
      if (arguments != 2) break;
      return set();
    case CommandId::kRun:
      if (arguments > 0) break;
      return answer(commands_.run());
    case CommandId::kStop:
      if (arguments > 0) break;
      return answer(commands_.stop());
    case CommandId::kHold:
      if (arguments != 2) break;
      return hold();
    case CommandId::kClear:
      if (arguments > 0) break;
      return answer(commands_.clear());
    case CommandId::kStream:
      return switch_to(id, streaming_);
    case CommandId::kPlot:
      return switch_to(id, plotting_);
    case CommandId::kEcho:
      return switch_to(id, echo_);
    case CommandId::kSave:
      if (arguments > 1) break;
      return with_preset(&Commands::save);
    case CommandId::kLoad:
      if (arguments != 1) break;
      return with_preset(&Commands::load);
    case CommandId::kForget:
      if (arguments != 1) break;
      return with_preset(&Commands::forget);
    case CommandId::kPresets:
      if (arguments > 0) break;
      return presets();
    case CommandId::kDefaults:
      if (arguments != 1 || !is(1, BIFA_TEXT("confirm"))) break;
      return finish_later(commands_.defaults());
    case CommandId::kZero:
      if (arguments != 1) break;
      if (is(1, BIFA_TEXT("confirm"))) return finish_later(commands_.zero(false));
      if (is(1, BIFA_TEXT("factory"))) return finish_later(commands_.zero(true));
      break;
  }
  answer_usage(id);
}

void Console::answer(Result result) {
  if (result != Result::kOk) print(out_, BIFA_TEXT("error "));
  print(out_, flash_text(kResultTexts, static_cast<uint8_t>(result)));
  print(out_, '\n');
}

void Console::answer_usage(CommandId id) {
  print(out_, BIFA_TEXT("error usage: "));
  print(out_, usage_of(static_cast<uint8_t>(id)));
  print(out_, '\n');
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
    if (state == State::kStopped) print(out_, BIFA_TEXT("[stopped: all valves off until clear\n"));
    if (state == State::kFault) print_fault(commands_.controller().status().fault);
  }
  if (!waiting_ || commands_.store().busy()) return;
  waiting_ = false;
  answer(commands_.store().result());
}

void Console::switch_to(CommandId id, bool& flag) {
  if (word_count_ != 2) return answer_usage(id);
  const bool on = is(1, BIFA_TEXT("on"));
  if (!on && !is(1, BIFA_TEXT("off"))) return answer_usage(id);
  flag = on;
  if (on && id == CommandId::kStream) {
    print(out_,
          BIFA_TEXT("[>sequence,time_us,state,psi body,head,tail,command body,head,tail,phase_deg body,head,tail\n"));
  }
  answer(Result::kOk);
}

void Console::help() {
  for (uint8_t i = 0; i < kCommandCount; ++i) print_help(usage_of(i), help_of(i));
  print(out_, BIFA_TEXT("[!  (at any time, no Enter) stop: all chambers vent until clear\n[parameters:"));
  for (uint8_t i = 0; i < kParameterCount; ++i) {
    print(out_, ' ');
    print(out_, name_of(static_cast<ParameterId>(i)));
  }
  print(out_, BIFA_TEXT("\n[try: set period_s 6, run, hold head positive, stop, help period_s\n"));
  answer(Result::kOk);
}

void Console::print_help(FlashText name, FlashText text) {
  print(out_, '[');
  print(out_, name);
  print(out_, BIFA_TEXT("  "));
  print(out_, text);
  print(out_, '\n');
}

void Console::help_on(const char* name) {
  ParameterId id;
  if (find_parameter(name, id)) {
    print_help(name_of(id), text_of(id, ParameterText::kHelp));
    print(out_, BIFA_TEXT("[range "));
    print_range(id);
    print(out_, BIFA_TEXT(", default "));
    print_decimal(out_, value_of(factory_preset(0), id), decimals_of(id));
    print(out_, BIFA_TEXT(", now "));
    print_decimal(out_, value_of(commands_.wanted(), id), decimals_of(id));
    print(out_, '\n');
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
  print_decimal(out_, minimum_of(id), decimals_of(id));
  print(out_, BIFA_TEXT(" to "));
  print_decimal(out_, maximum_of(id), decimals_of(id));
  const FlashText unit = text_of(id, ParameterText::kUnit);
  if (flash_byte(unit) != 0) print(out_, ' ');
  print(out_, unit);
}

void Console::version() {
  print(out_, BIFA_TEXT("[bifa "));
  for (uint8_t i = 0; i < sizeof kFirmwareVersion; ++i) {
    if (i > 0) print(out_, '.');
    print_number(out_, kFirmwareVersion[i]);
  }
  print(out_, BIFA_TEXT(", protocol "));
  print_number(out_, kProtocolVersion);
  print(out_, BIFA_TEXT(", table "));
  print_number(out_, kTableHash);
  print(out_, BIFA_TEXT(", started by "));
  print(out_, flash_text(kStartCauseWords, static_cast<uint8_t>(session_.cause())));
  print(out_, '\n');
}

void Console::status() {
  const Status status = commands_.controller().status();
  print(out_, BIFA_TEXT("[state "));
  print(out_, flash_text(kStateWords, static_cast<uint8_t>(status.state)));
  if (status.scheduled) print(out_, BIFA_TEXT(", timed holds"));
  if (status.emergency_stop) print(out_, BIFA_TEXT(", emergency stop pressed"));
  print(out_, '\n');
  if (status.fault.fault != Fault::kNone) print_fault(status.fault);
  print(out_, BIFA_TEXT("[psi "));
  print_triple(status.pressure_mpsi);
  print(out_, BIFA_TEXT("\n[valves"));
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    print(out_, ' ');
    print(out_, flash_text(kChamberWords, i));
    print(out_, ' ');
    // the two bits of a chamber, positive and vacuum, in the order of ChamberState
    const uint8_t bits = status.valves >> (2 * i) & 3;
    print(out_, flash_text(kChamberStateWords, bits == 1 ? 2 : bits == 2 ? 1 : 0));
  }
  print(out_, BIFA_TEXT("\n[link: frames bad "));
  print_number(out_, counters_.frames_bad);
  print(out_, BIFA_TEXT(", repeated "));
  print_number(out_, session_.repeated());
  print(out_, BIFA_TEXT(", bytes lost "));
  print_number(out_, counters_.bytes_lost);
  print(out_, BIFA_TEXT(", samples lost "));
  print_number(out_, status.samples_lost);
  print(out_, '\n');
}

void Console::print_triple(const int16_t (&pressure_mpsi)[kChamberCount]) {
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    if (i > 0) print(out_, ' ');
    print(out_, flash_text(kChamberWords, i));
    print(out_, ' ');
    print_signed(out_, pressure_mpsi[i], 3);
  }
}

void Console::print_fault(const FaultReport& fault) {
  print(out_, BIFA_TEXT("[fault "));
  print(out_, flash_text(kFaultWords, static_cast<uint8_t>(fault.fault)));
  if (fault.channel < kChamberCount) {
    print(out_, ' ');
    print(out_, flash_text(kChamberWords, fault.channel));
  }
  print(out_, BIFA_TEXT(" value "));
  print_signed(out_, fault.value, 0);
  print(out_, BIFA_TEXT(" limit "));
  print_signed(out_, fault.limit, 0);
  print(out_, BIFA_TEXT(" at_ms "));
  print_number(out_, fault.time_ms);
  print(out_, BIFA_TEXT("\n[the second before, psi from "));
  print_triple(fault.lowest_mpsi);
  print(out_, BIFA_TEXT(" to "));
  print_triple(fault.highest_mpsi);
  print(out_, '\n');
}

void Console::show_parameter(ParameterId id) {
  print(out_, '[');
  print(out_, name_of(id));
  print(out_, ' ');
  print_decimal(out_, value_of(commands_.wanted(), id), decimals_of(id));
  print(out_, '\n');
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
      print(out_, BIFA_TEXT("error not a decimal number; "));
      break;
    case DecimalResult::kOutOfRange:
      print(out_, BIFA_TEXT("error out of range; "));
      break;
  }
  print(out_, name_of(id));
  print(out_, BIFA_TEXT(" is "));
  print_range(id);
  print(out_, '\n');
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

void Console::presets() {
  char name[kNameSize + 1];
  bool stored;
  for (uint8_t i = 0; commands_.preset_at(i, name, stored); ++i) {
    print(out_, '[');
    print(out_, name);
    print(out_, stored ? BIFA_TEXT(" saved\n") : BIFA_TEXT(" factory\n"));
  }
  answer(Result::kOk);
}

void Console::sample(const Sample& sample) {
  if (!streaming_ && !plotting_) return;
  // A line is printed whole or not at all, and telemetry never makes anything wait.
  if (out_.room() < kRoomForSample) return;
  if (streaming_) print_stream(sample);
  if (plotting_) print_plot(sample);
}

void Console::print_stream(const Sample& sample) {
  print(out_, '>');
  print_number(out_, sample.sequence);
  print(out_, ',');
  print_number(out_, sample.time_us);
  print(out_, ',');
  print(out_, flash_text(kStateWords, static_cast<uint8_t>(sample.state)));
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    print(out_, ',');
    print_signed(out_, sample.pressure_mpsi[i], 3);
  }
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    print(out_, ',');
    print(out_, flash_text(kChamberStateWords, static_cast<uint8_t>(sample.command[i])));
  }
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    print(out_, ',');
    print_number(out_, static_cast<uint32_t>(sample.phase[i]) * 360 >> 16);
  }
  print(out_, '\n');
}

void Console::print_plot(const Sample& sample) {
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    if (i > 0) print(out_, '\t');
    print(out_, flash_text(kChamberWords, i));
    print(out_, BIFA_TEXT("_psi:"));
    print_signed(out_, sample.pressure_mpsi[i], 3);
  }
  print(out_, '\n');
}

}  // namespace bifa
