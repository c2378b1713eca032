// Arbitrary lines on the console: each is answered exactly once.
#include <stdlib.h>

#include <algorithm>
#include <string>

#include "board_harness.cpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  // No 0x00: frames would swallow lines. No `echo`: it repeats input that may look like an answer. No backspaces, with
  // which the word could be edited into a line.
  std::string input;
  for (size_t i = 0; i < size; ++i) {
    if (data[i] != 0 && data[i] != 0x08 && data[i] != 0x7F) input.push_back(static_cast<char>(data[i]));
  }
  if (input.find("echo") != std::string::npos) return 0;
  Board board;
  board_run(&board, 2, 0);
  board.output.clear();
  size_t lines = 0;
  std::string text;
  for (const uint8_t c : input) {
    board_send(&board, &c, 1);
    if (c != '\n') continue;
    ++lines;
    board_run(&board, 4000, 0);
    text.assign(board.output.begin(), board.output.end());
    // A command has switched on output that adds lines of its own.
    if (text.find("[>") != std::string::npos || text.find("_psi:") != std::string::npos) return 0;
  }
  board_run(&board, 4000, 0);
  text.assign(board.output.begin(), board.output.end());
  size_t answers = 0;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    const std::string line = text.substr(at, end - at);
    answers += line.compare(0, 2, "ok") == 0 || line.compare(0, 5, "error") == 0;
    at = end + 1;
  }
  if (answers != lines) abort();
  return 0;
}
