#include "console.h"

#include "decimal.h"
#include "output.h"

namespace bifa {

namespace {
const char kBackspace = 0x08;
const char kDelete = 0x7F;
// A frame of telemetry (31 bytes) may already be in the ring; the bytes of a long line beyond this room take 1.2 ms.
const uint8_t kRoomForSample = 60;

FlashText usage_of(uint8_t command) { return flash_text(kCommandTexts, 2 * command); }
FlashText help_of(uint8_t command) { return flash_text(kCommandTexts, 2 * command + 1); }
FlashText name_of(ParameterId id) { return text_of(id, ParameterText::kName); }
/// The command whose usage begins with `name`; kCommandCount if there is none.
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
bool takes_words(uint8_t command, uint8_t count) {
  const uint8_t bounds = flash_byte(&kCommandWords[command]);
  return count >= bounds >> 4 && count <= (bounds & 0x0F);
}
void print_word(const char* list, uint8_t index) { print(flash_text(list, index)); }
uint8_t decimals_of(ParameterId id) { return flash_byte(&descriptor(id).decimals); }
void print_number_of(ParameterId id, uint32_t value) { print_decimal(value, decimals_of(id)); }
/// Prints at least three decimals, so that two values line up.
void print_places(ParameterId id, uint32_t value) {
  const uint8_t kLeast = 3;
  print_decimal(value, decimals_of(id), kLeast);
}
void print_unit(ParameterId id) {
  const FlashText unit = text_of(id, ParameterText::kUnit);
  if (flash_byte(unit) != 0) print(' ');
  print(unit);
}
void print_name(ParameterId id) {
  print('[');
  print(name_of(id));
  print(' ');
}
}  // namespace

void Console::greet() {
  print_version();
  print(BIFA_TEXT("[type help\r\n"));
}

void Console::feed(uint8_t byte) {
  const char c = static_cast<char>(byte);
  if (c == '\r') {
    // Many terminals send only a carriage return for the Enter key; programs send it before the line feed.
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
    match_stop(c);
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
  if (echo_) print_line_end();
  line_[length_] = '\0';
  length_ = 0;
  // A stop counts whatever precedes it: fragments of a frame, noise, a line whose end was lost.
  if ((spoilt_ || too_long_) && stop_matched_ == kStopLetters) {
    stop();
  } else if (too_long_) {
    print(BIFA_TEXT("error the line exceeds 63 characters\r\n"));
  } else if (spoilt_) {
    print(BIFA_TEXT("error the line arrived damaged\r\n"));
  } else {
    execute();
  }
  spoilt_ = too_long_ = false;
  stop_matched_ = 0;
}

void Console::match_stop(char c) {
  static const char kStop[] BIFA_FLASH = "stop";
  if (c == ' ' || c == '\t') return;
  if (stop_matched_ == kStopLetters || c != static_cast<char>(flash_byte(kStop + stop_matched_))) stop_matched_ = 0;
  if (c == static_cast<char>(flash_byte(kStop + stop_matched_))) ++stop_matched_;
}

void Console::execute() {
  word_count_ = 0;
  words_[0] = line_;  // an empty command if there is no word
  for (char* at = line_; *at != '\0';) {
    while (*at == ' ' || *at == '\t') *at++ = '\0';
    if (*at == '\0') break;
    if (word_count_ == kWords) {
      ++word_count_;  // more than any command has
      break;
    }
    words_[word_count_++] = at;
    while (*at != '\0' && *at != ' ' && *at != '\t') ++at;
  }
  command_ = find_command(words_[0]);
  if (word_count_ == 0) return answer(Result::kOk);
  if (command_ == kCommandCount) return answer(Result::kUnknown);
  commands_.controller().host_heard();
  if (!takes_words(command_, word_count_)) return answer_usage();
  dispatch(static_cast<CommandId>(command_), *this);
}

bool Console::is(uint8_t word, FlashText text) const {
  return flash_equal(words_[word], reinterpret_cast<const char*>(text));
}

void Console::answer(Result result) {
  if (result != Result::kOk) print(BIFA_TEXT("error "));
  print(flash_text(kResultTexts, static_cast<uint8_t>(result)));
  print_line_end();
}

void Console::answer_usage() {
  print(BIFA_TEXT("error usage: "));
  print(usage_of(command_));
  print_line_end();
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
    if (state == State::kStopped) print(BIFA_TEXT("[stopped: all valves off until clear\r\n"));
    if (state == State::kFault) print_fault(commands_.controller().status().fault);
  }
  if (!waiting_) return;
  commands_.controller().host_heard();  // its input is not read until the EEPROM has been written
  if (commands_.store().busy()) return;
  waiting_ = false;
  if (static_cast<CommandId>(command_) == CommandId::kZero) print_offsets();
  answer(commands_.store().result());
}

void Console::switch_to(bool& flag) {
  const bool on = is(1, BIFA_TEXT("on"));
  if (!on && !is(1, BIFA_TEXT("off"))) return answer_usage();
  flag = on;
  if (on && &flag == &streaming_) {
    print(BIFA_TEXT("[>sequence,time_us,state,psi body,head,tail,command body,head,tail,phase_deg body,head,tail\r\n"));
  }
  answer(Result::kOk);
}

void Console::help() {
  if (word_count_ > 1) return help_on(words_[1]);
  for (uint8_t i = 0; i < kCommandCount; ++i) print_help(usage_of(i), help_of(i));
  print(BIFA_TEXT("[!  (at any time, no Enter) stop: all chambers vent until clear\r\n[parameters:"));
  for (uint8_t i = 0; i < kParameterCount; ++i) {
    print(' ');
    print(name_of(static_cast<ParameterId>(i)));
  }
  print(BIFA_TEXT("\r\n[try: set period_s 6, run, help run\r\n"));
  answer(Result::kOk);
}

void Console::print_help(FlashText name, FlashText text) {
  print('[');
  print(name);
  print(BIFA_TEXT("  "));
  print(text);
  print_line_end();
}

void Console::help_on(const char* name) {
  ParameterId id;
  if (find_parameter(name, id)) {
    print_help(name_of(id), text_of(id, ParameterText::kHelp));
    return show();
  }
  const uint8_t command = find_command(name);
  if (command < kCommandCount) {
    print_help(usage_of(command), help_of(command));
    return answer(Result::kOk);
  }
  answer(Result::kUnknown);
}

void Console::print_value(ParameterId id, uint32_t value) {
  print_number_of(id, value);
  print_unit(id);
}

void Console::print_range(ParameterId id) {
  print_number_of(id, minimum_of(id));
  print(BIFA_TEXT(" to "));
  print_value(id, maximum_of(id));
}

void Console::version() {
  print_version();
  answer(Result::kOk);
}

void Console::print_version() {
  print(BIFA_TEXT("[bifa " BIFA_VERSIONS ", started by "));
  print_word(kStartCauseWords, static_cast<uint8_t>(session_.cause()));
  print_line_end();
}

void Console::status() {
  const Status status = commands_.controller().status();
  print(BIFA_TEXT("[state "));
  print_word(kStateWords, static_cast<uint8_t>(status.state));
  if (status.scheduled) print(BIFA_TEXT(", timed holds"));
  if (status.emergency_stop) print(BIFA_TEXT(", emergency stop pressed"));
  print_line_end();
  if (status.fault.fault != Fault::kNone) print_fault(status.fault);
  print(BIFA_TEXT("[psi "));
  print_triple(status.pressure_mpsi);
  print(BIFA_TEXT("\r\n[valves"));
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    print(' ');
    print_word(kChamberWords, i);
    print(' ');
    // the two bits of a chamber, positive and vacuum, in the order of ChamberState
    const uint8_t bits = status.valves >> (2 * i) & 3;
    print_word(kChamberStateWords, bits == 1 ? 2 : bits == 2 ? 1 : 0);
  }
  print(BIFA_TEXT("\r\n[link: frames bad "));
  print_number(counters_.frames_bad);
  print(BIFA_TEXT(", repeated "));
  print_number(session_.repeated());
  print(BIFA_TEXT(", bytes lost "));
  print_number(counters_.bytes_lost);
  print(BIFA_TEXT(", samples lost "));
  print_number(status.samples_lost);
  print_line_end();
  answer(Result::kOk);
}

void Console::print_triple(const int16_t (&pressure_mpsi)[kChamberCount]) {
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    if (i > 0) print(' ');
    print_word(kChamberWords, i);
    print(' ');
    print_signed(pressure_mpsi[i], 3);
  }
}

void Console::print_fault(const FaultReport& fault) {
  print(BIFA_TEXT("[fault "));
  print_word(kFaultWords, static_cast<uint8_t>(fault.fault));
  if (fault.channel < kChamberCount) {
    print(' ');
    print_word(kChamberWords, fault.channel);
  }
  print(BIFA_TEXT(" value "));
  print_signed(fault.value, 0);
  print(BIFA_TEXT(" limit "));
  print_signed(fault.limit, 0);
  print(BIFA_TEXT(" at_ms "));
  print_number(fault.time_ms);
  print(BIFA_TEXT("\r\n[the second before, psi from "));
  print_triple(fault.lowest_mpsi);
  print(BIFA_TEXT(" to "));
  print_triple(fault.highest_mpsi);
  print_line_end();
}

void Console::show_parameter(ParameterId id, const ParameterSet& saved) {
  const uint32_t value = value_of(commands_.wanted(), id);
  print_name(id);
  print_value(id, value);
  print(BIFA_TEXT(" ("));  // so that the value is separated by spaces with or without a unit
  print_range(id);
  print(BIFA_TEXT(", default "));
  print_value(id, value_of(factory_preset(0), id));
  print(')');
  const uint32_t saved_value = value_of(saved, id);
  if (saved_value != value) {
    print(BIFA_TEXT(" * power-up "));
    print_value(id, saved_value);
  }
  print_line_end();
}

void Console::show() {
  ParameterId one;
  if (word_count_ == 2 && !find_parameter(words_[1], one)) return answer(Result::kNoParameter);
  const ParameterSet saved = commands_.at_power_up();
  for (uint8_t i = 0; i < kParameterCount; ++i) {
    const ParameterId id = static_cast<ParameterId>(i);
    if (word_count_ < 2 || id == one) show_parameter(id, saved);
  }
  answer(Result::kOk);
}

void Console::set() {
  ParameterId id;
  if (!find_parameter(words_[1], id)) return answer(Result::kNoParameter);
  uint32_t value;
  switch (parse_decimal(words_[2], decimals_of(id), minimum_of(id), maximum_of(id), value)) {
    case DecimalResult::kOk:
      print_name(id);
      print_places(id, value_of(commands_.wanted(), id));
      print(BIFA_TEXT(" -> "));
      print_places(id, value);
      print_unit(id);
      print_line_end();
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
  print_line_end();
}

void Console::hold() {
  for (uint8_t chamber = 0; chamber < kChamberCount; ++chamber) {
    if (!is(1, flash_text(kChamberWords, chamber))) continue;
    for (uint8_t state = 0; state <= static_cast<uint8_t>(ChamberState::kPositive); ++state) {
      if (is(2, flash_text(kChamberStateWords, state))) return answer(commands_.hold(chamber, state));
    }
  }
  answer_usage();
}

const char* Console::preset_name() {
  if (word_count_ < 2) return kStartPreset;
  // Copied to the beginning of line_, padded with zeros, over words that are no longer needed.
  const char* from = words_[1];
  for (uint8_t i = 0; i <= kNameSize; ++i) {
    line_[i] = *from;
    if (*from != '\0') ++from;
  }
  if (line_[kNameSize] != '\0') line_[0] = '\0';  // longer than any name
  return line_;
}

void Console::defaults() {
  if (!is(1, BIFA_TEXT("confirm"))) return answer_usage();
  finish_later(commands_.defaults());
}

void Console::zero() {
  const bool factory = is(1, BIFA_TEXT("factory"));
  if (!factory && !is(1, BIFA_TEXT("confirm"))) return answer_usage();
  print_offsets();
  finish_later(commands_.zero(factory));
}

void Console::print_offsets() {
  print(BIFA_TEXT("[offset psi "));
  print_triple(commands_.controller().calibration().offset_mpsi);
  print_line_end();
}

void Console::presets() {
  char name[kNameSize + 1];
  bool stored;
  for (uint8_t i = 0; commands_.preset_at(i, name, stored); ++i) {
    print('[');
    print(name);
    print(stored ? BIFA_TEXT(" saved\r\n") : BIFA_TEXT(" factory\r\n"));
  }
  answer(Result::kOk);
}

void Console::sample(const Sample& sample) {
  if (!streaming_ && !plotting_) return;
  // A line is printed completely or not at all, and telemetry must not block anything for long.
  if (output_room() < kRoomForSample) return commands_.controller().lose_sample();
  if (streaming_) print_stream(sample);
  if (plotting_) print_plot(sample);
}

void Console::print_stream(const Sample& sample) {
  print('>');
  print_number(sample.sequence);
  print(',');
  print_number(sample.time_us);
  print(',');
  print_word(kStateWords, static_cast<uint8_t>(sample.state));
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    print(',');
    print_signed(sample.pressure_mpsi[i], 3);
  }
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    print(',');
    print_word(kChamberStateWords, static_cast<uint8_t>(sample.command[i]));
  }
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    print(',');
    print_number(static_cast<uint32_t>(sample.phase[i]) * 360 >> 16);
  }
  print_line_end();
}

void Console::print_plot(const Sample& sample) {
  for (uint8_t i = 0; i < kChamberCount; ++i) {
    if (i > 0) print('\t');
    print_word(kChamberWords, i);
    print(BIFA_TEXT("_psi:"));
    print_signed(sample.pressure_mpsi[i], 3);
  }
  print_line_end();
}

}  // namespace bifa
