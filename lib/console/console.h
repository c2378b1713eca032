// The text console. Every line is answered by exactly one line that begins with "ok" or "error", after any lines of
// information, which begin with "[".
#pragma once

#include "commands.h"
#include "print.h"
#include "session.h"

namespace bifa {

const uint8_t kLongestLine = 63;

class Console {
 public:
  // Not inlined: clearing a member then costs two bytes of code instead of four.
  __attribute__((noinline)) Console(Commands& commands, const Session& session)
      : commands_(commands), session_(session) {}

  /// Prints the greeting at start.
  void greet();

  /// Takes one byte of text; call only while not waiting().
  void feed(uint8_t byte);
  /// Call if bytes were lost: the present line is answered with an error, unless it ends in "stop".
  void spoil() { spoilt_ = true; }
  /// Call after a frame that is none: a stray 0x00 may have begun it within a line, whose rest it took.
  void spoil_begun() {
    if (length_ > 0) spoil();
  }

  /// Whether the last command is still busy (EEPROM) and has not been answered.
  bool waiting() const { return waiting_; }
  /// Answers the pending command once it is finished; reports stops and faults as they occur.
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

  // One for each command of the schema; words_ holds the words of its line, as many as it takes.
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
  uint8_t stop_matched_ = 0;  ///< how many letters of "stop" the line ends in, ignoring blanks
  uint8_t word_count_ = 0;
  uint8_t command_ = 0;  ///< of the line being executed
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
