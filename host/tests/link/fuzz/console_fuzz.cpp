// Any lines on the console: every one is answered exactly once, and the parameters stay within their ranges.
#include <stdlib.h>

#include <algorithm>

#include "fuzz_board.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  // Not 0x00: frames would swallow lines. Not echo: it repeats what may look like an answer; so no backspaces either,
  // with which the word could be made.
  std::string input;
  for (size_t i = 0; i < size; ++i) {
    if (data[i] != 0 && data[i] != 0x08 && data[i] != 0x7F) input.push_back(static_cast<char>(data[i]));
  }
  if (input.find("echo") != std::string::npos) return 0;
  FuzzBoard board;
  board.run_ms(2);
  text.clear();
  size_t lines = 0;
  for (const char c : input) {
    board.send(static_cast<uint8_t>(c));
    if (c != '\n') continue;
    ++lines;
    board.run_ms(4000);
    if (board.is_noisy()) return 0;
  }
  board.run_ms(4000);
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
