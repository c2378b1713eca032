// The text console: lines in, lines out. Every line is answered by exactly one line that begins "ok" or "error", after
// any lines of information, which begin "[".
#pragma once

#include "commands.h"
#include "print.h"
#include "session.h"

namespace bifa {

const uint8_t kLongestLine = 63;

class Console {
 public:
  // Out of line: what it clears costs two bytes of code each instead of four.
  __attribute__((noinline)) Console(Commands& commands, const Session& session)
      : commands_(commands), session_(session) {}

  /// What a person sees at start.
  void greet();

  /// Takes one byte of text. Only while not waiting().
  void feed(uint8_t byte);
  /// Bytes were lost: the present line is answered with an error, unless it ends in "stop".
  void spoil() { spoilt_ = true; }

  /// Whether the last command is still busy (EEPROM) and its answer is owed.
  bool waiting() const { return waiting_; }
  /// Answers the command that was waited for, once it is finished; tells of stops and faults as they come.
  void poll(const LinkCounters& counters);

  /// Prints a sample if streaming or plotting is on.
  void sample(const Sample& sample);

 private:
  void end_line();
  void execute();
  void match_stop(char c);
  void answer(Result result);
  void answer_usage();
  void finish_later(Result started);
  bool is(uint8_t word, FlashText text) const;

  // One for each command of the schema; the words of its line are words_, as many as it takes.
  friend void dispatch<Console>(CommandId, Console&);
  void help();
  void version();
  void status();
  void show();
  void set();
  void run() { answer(commands_.run()); }
  void stop() { answer(commands_.stop()); }
  void hold();
  void clear() { answer(commands_.clear()); }
  void stream() { switch_to(streaming_); }
  void plot() { switch_to(plotting_); }
  void save() { finish_later(commands_.save(preset_name())); }
  void load() { answer(commands_.load(preset_name())); }
  void presets();
  void forget() { finish_later(commands_.forget(preset_name())); }
  void defaults();
  void zero();
  void echo() { switch_to(echo_); }

  void switch_to(bool& flag);
  const char* preset_name();
  void help_on(const char* name);
  void print_version();
  void print_offsets();
  void print_help(FlashText name, FlashText text);
  void print_range(ParameterId id);
  void print_value(ParameterId id, uint32_t value);
  void show_parameter(ParameterId id, const ParameterSet& saved);
  void print_fault(const FaultReport& fault);
  void print_triple(const int16_t (&pressure_mpsi)[kChamberCount]);
  void print_stream(const Sample& sample);
  void print_plot(const Sample& sample);

  static const uint8_t kWords = 4;
  static const uint8_t kStopLetters = 4;

  Commands& commands_;
  const Session& session_;
  uint8_t length_ = 0;
  uint8_t stop_matched_ = 0;  ///< how many letters of "stop" the line ends in, blanks aside
  uint8_t word_count_ = 0;
  uint8_t command_ = 0;  ///< of the line that is carried out
  LinkCounters counters_ = {};
  State last_state_ = State::kIdle;
  bool spoilt_ = false;
  bool too_long_ = false;
  bool waiting_ = false;
  bool echo_ = false;
  bool after_return_ = false;
  bool streaming_ = false;
  bool plotting_ = false;
  char* words_[kWords];
  char line_[kLongestLine + 1];
};

}  // namespace bifa
